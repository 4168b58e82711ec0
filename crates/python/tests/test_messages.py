"""Error messages use the terms of the user and say what to write instead."""

import importlib
import warnings

import herglotz as hz
import numpy as np
import pytest
import sympy

FORMULA = "x'^2/2 - x^2/2 + gamma*z"
GOOD = dict(L=FORMULA, q0=[1.0], v0=[0.0], t=1.0, coordinates=["x"], parameters={"gamma": -0.1})


def formula(text, **change):
    return GOOD | dict(L=text, parameters={}) | change


def function(L, **change):
    return dict(L=L, q0=[1.0], v0=[0.0], t=1.0) | change


def spline(t, q, v, z):
    # SciPy's CubicSpline begins with this conversion of its argument.
    return v @ v / 2 - np.interp(0.5, [0.0, 1.0], [0.0, 1.0]) * np.asarray(q[0], dtype=float)


X, XDOT, Z, GAMMA, T = sympy.symbols("x xdot z gamma t")
XT, F = sympy.Function("x")(T), sympy.Function("f")(T)

# Requests, and the expected messages.
SAID = {
    "all velocities": (formula("v^2/2"), "the velocities are `x'` and so on"),
    "a velocity by its name elsewhere": (formula("xdot^2/2 - x^2"), "did you mean `x'`?"),
    "the rate of the action": (formula("x'^2/2 - z'"), "the rate of `z` is the Lagrangian itself"),
    "a second derivative": (formula("x'^2/2 + x*x''"), "write L in terms of `x` and `x'`"),
    "a product of vectors": (formula("v@v/2"), r"written `sum\(i, 0, n-1"),
    "a function of NumPy in a text": (formula("x'^2/2 + np.cos(x)"), r"write `sin\(x\)` for `np.sin\(x\)`"),
    "np.interp with a period": (
        function(lambda t, q, v, z: v @ v / 2 - np.interp(q[0], [0.0, 1.0], [0.0, 1.0], period=1.0)),
        "np.interp with a period.*hz.where",
    ),
    "a spline": (function(spline), "spline.*hz.where"),
    "float": (function(lambda t, q, v, z: v @ v / 2 - float(q[0])), "traced value.*np.where"),
    "np.trapezoid's like": (function(lambda t, q, v, z: v @ v / 2 - np.floor(q[0])), "np.floor.*hz.where"),
    "a random number": (function(lambda t, q, v, z: v @ v / 2 - np.linalg.det(np.outer(q, v))), "np.linalg.det.*write"),
    "SymPy with names of functions": (
        function(XT.diff(T) ** 2 / 2 - XT**2 / 2, coordinates=["x"]),
        r"x\(t\).*coordinates=\[x\(t\)\]",
    ),
    "SymPy with a second derivative": (function(XT.diff(T) ** 2 / 2 + XT * XT.diff(T, 2)), "second derivative"),
    "SymPy with a function that is none": (function(XT.diff(T) ** 2 / 2 + F * XT), r"f\(t\).*coordinates=\[x\(t\)\]"),
    "SymPy with a function beside its coordinate": (
        function(XT.diff(T) ** 2 / 2 + F * XT, coordinates=[XT]),
        r"`f\(t\)`.*write it out",
    ),
    "SymPy with z'": (function(XDOT**2 / 2 + sympy.Function("z")(T).diff(T), coordinates=[X]), "z.*symbol `z`"),
    "a direction of SciPy": (GOOD | dict(events=hz.Event("x", -1)), 'the direction -1 of the event "x".*write "falling"'),
    "the other direction of SciPy": (GOOD | dict(events=hz.Event("x", 1)), 'write "rising"'),
    "no direction of SciPy": (GOOD | dict(events=hz.Event("x", 0)), 'write "both"'),
    "steps as a float": (GOOD | dict(integrator="gauss_4", steps=1e3), "`steps` is 1000.0; it must be an integer.*write 1000"),
    "negative steps": (GOOD | dict(integrator="gauss_4", steps=-1), "`steps` is -1; it must be an integer of at least 1"),
    "no steps": (GOOD | dict(integrator="gauss_4", steps=0), "`steps` is 0; it must be an integer of at least 1"),
    "half a step": (GOOD | dict(integrator="gauss_4", steps=2.5), "`steps` is 2.5; it must be an integer"),
    "a text of steps": (GOOD | dict(integrator="gauss_4", steps="10"), "`steps` is '10'; it must be an integer"),
    "too many steps": (GOOD | dict(integrator="gauss_4", steps=10**30), "`steps` is 1000000.*must be an integer"),
    "true steps": (GOOD | dict(integrator="gauss_4", steps=True), "`steps` is True"),
    "rows every float": (GOOD | dict(integrator="gauss_4", steps=10, every=2.0), "`every` is 2.0.*write 2"),
    "rows every -1": (GOOD | dict(integrator="gauss_4", steps=10, every=-1), "`every` is -1; it must be an integer"),
    "an integrator by its number": (GOOD | dict(integrator=8), "`integrator` is 8; it must be a string"),
    "a class for an integrator": (GOOD | dict(integrator="RK45"), '"RK45"'),
    "observers in a list": (GOOD | dict(observe=["x^2"]), r"`observe` is \['x\^2'\].*observe=\{"),
    "an observer alone": (GOOD | dict(observe="x^2"), r"`observe` is 'x\^2'.*observe=\{"),
    "parameters in a list": (GOOD | dict(parameters=[("gamma", -0.1)]), r"`parameters` is \[.*parameters=\{"),
    "a time transformation": (GOOD | dict(integrator="transformed_gauss_8", step=0.1), "not available for a formula or a function"),
    "a claim": (formula("x'^2/2 + x^2*x'^2", integrator="strang", step=0.1), "not separable"),
    "a parameter without a value": (formula("x'^2/2 - k*x^2/2"), r"unknown name `k`; a parameter needs a value, as in parameters=\{\"k\": 1.0\}"),
    "a parameter of a column": (GOOD | dict(observe={"a": "k*x"}), r"the column \"k\*x\".*parameters=\{\"k\""),
    "a parameter of an event": (GOOD | dict(events="x - k"), r"the event \"x - k\".*parameters=\{\"k\""),
    "a parameter of a reset": (GOOD | dict(events=hz.Event("x", reset={"x'": "-k*x'"})), r"the reset.*parameters=\{\"k\""),
    "a parameter of a force": (GOOD | dict(force="-k*x'"), r"the force on \"x\".*parameters=\{\"k\""),
    "a misspelt parameter": (GOOD | dict(observe={"a": "gama*x"}), "unknown name `gama`; did you mean `gamma`"),
    "an unknown function": (formula("x'^2/2 - foo(x)"), "unknown function `foo`; the functions are sqrt, abs, .*atan2.*sum"),
    "a function with another end": (formula("x'^2/2 - cosine(x)"), "unknown function `cosine`; functions with a similar name are cos, cosh"),
    "a function with another beginning": (formula("x'^2/2 - arccos(x)"), "unknown function `arccos`; did you mean `acos`"),
    "a constraint twice": (
        dict(L="(x'^2 + y'^2 + w'^2)/2", q0=[0.0, -1.0, 0.0], v0=[1.0, 0.0, 0.0], t=1.0, coordinates=["x", "y", "w"],
             constraints=["x^2 + y^2 = 1", "2*x^2 + 2*y^2 = 2"]),
        r'dependent at the start: 1 of 2 are independent, and constraint "(x\^2 \+ y\^2 = 1|2\*x\^2 \+ 2\*y\^2 = 2)"',
    ),
    "a start off a constraint": (
        dict(L="(x'^2 + y'^2)/2", q0=[0.0, -2.0], v0=[1.0, 0.0], t=1.0, coordinates=["x", "y"], constraints="x^2 + y^2 = 1"),
        r'constraint "x\^2 \+ y\^2 = 1" has the value 3e0',
    ),
    "a table that nothing uses": (GOOD | dict(tables={"drive": hz.table([0.0, 1.0], [0.0, 1.0])}), r"the table 'drive' is not used.*drive\(t\)"),
    "too exact": (GOOD | dict(accuracy=1e-40), "is not reached.*round-off"),
    "something too fast": (
        formula("x'^2/2 + sin(1e12*t)*x*1e12", accuracy=1e-6),
        "(?s)is not reached.*near t = .*shorter span|used up",
    ),
}

# Names of the Rust libraries, or of their internals.
FOREIGN = ["`structure`", "take a time transformation", "HAS_", "Stepper", "argument '", "OverflowError", "`by`", "FormulaLagrangian", "dt_dtau"]


@pytest.mark.parametrize("asked, said", SAID.values(), ids=SAID)
def test_what_is_refused_says_what_to_write(asked, said):
    with pytest.raises((ValueError, TypeError), match=said) as caught:
        hz.solve(**asked)
    assert not [word for word in FOREIGN if word in str(caught.value)]


@pytest.mark.parametrize("call", ["solve", "ensemble", "check", "compare", "path", "fit", "value_and_grad"])
def test_unused_tables_and_parameters_are_refused_everywhere(call):
    drive, many = {"drive": hz.table([0.0, 1.0], [0.0, 1.0])}, dict(q0=[[1.0]], v0=[[0.0]])
    other = {
        "ensemble": many,
        "path": dict(v0=None, q1=[0.9], steps=4),
        "fit": dict(t=[0.0, 0.5, 1.0], data={"x": [1.0, 0.9, 0.5]}, unknowns=["gamma"]),
    }
    given = {name: x for name, x in (GOOD | other.get(call, {})).items() if x is not None}
    of = hz.value_and_grad("x") if call == "value_and_grad" else getattr(hz, call)
    with pytest.raises(ValueError, match="the table 'drive' is not used"):
        of(**given, tables=drive)
    with pytest.raises(ValueError, match="the parameter 'gama' is not used.*did you mean 'gamma'"):
        of(**given | dict(parameters={"gamma": -0.1, "gama": 1.0}))


def test_functions_of_other_packages_are_named():
    jnp = pytest.importorskip("jax.numpy")
    for L in (lambda t, q, v, z: v @ v / 2 - jnp.cos(q[0]), lambda t, q, v, z: jnp.sum(v * v) / 2, lambda t, q, v, z: jnp.dot(v, v)):
        with pytest.raises(TypeError, match="calls a function of jax.*write np.cos for jnp.cos"):
            hz.solve(L, [1.0], [0.0], 1.0)
    with pytest.raises(TypeError, match="calls a function of jax"):
        hz.solve("x'^2/2", [1.0], [0.0], 1.0, coordinates=["x"], force=lambda t, q, v, z: -jnp.cos(q))
    with pytest.raises(TypeError, match="calls a function of jax"):
        hz.is_contact(lambda q, p, z: (jnp.cos(q), p, z), ([1.0], [0.0], 0.0))


def test_a_lattice_of_functions_says_what_to_write():
    given = dict(q0=[1.0, 0.0], v0=0.0, t=1.0, step=0.1)
    with pytest.raises(TypeError, match="`site` is .*formulas, as in site="):
        hz.lattice(lambda t, q, v, z: v @ v / 2, **given)
    with pytest.raises(TypeError, match="`bond` is .*formulas, as in bond="):
        hz.lattice("x'^2/2", lambda a, b: (a - b) ** 2, **given)


@pytest.mark.parametrize("package", ["jax", "torch"])
def test_parameters_that_are_arrays_are_named(package):
    pytest.importorskip(package)
    of = importlib.import_module(f"herglotz.{package}").solve
    with pytest.raises(ValueError, match=r"parameters\['gamma'\]` has the shape \(1,\)"):
        of(FORMULA, [1.0], [0.0], 1.0, coordinates=["x"], parameters={"gamma": np.array([-0.1])})
    with pytest.raises(ValueError, match=r"`z0` has the shape \(1,\)"):
        of(FORMULA, [1.0], [0.0], 1.0, coordinates=["x"], parameters={"gamma": -0.1}, z0=np.zeros(1))


def test_the_plan_says_that_a_given_step_became_another():
    given = GOOD | dict(integrator="gauss_4")
    assert "the steps of 0.3 became 0.25" in hz.solve(**given, step=0.3).plan.text
    assert "became" not in hz.solve(**given, step=0.25).plan.text and "became" not in hz.solve(**given, step=0.1).plan.text


GAINS = "the motion gains energy"


def test_a_positive_rate_is_warned_of():
    gain = dict(parameters={"gamma": 0.1})
    calls = [
        lambda: hz.solve(**GOOD | gain),
        lambda: hz.solve(H="p_x^2/2 + x^2/2 - gamma*z", q0=[1.0], p0=[0.0], t=1.0, coordinates=["x"], **gain),
        lambda: hz.ensemble(FORMULA, [[1.0]], [[0.0]], 1.0, coordinates=["x"], parameters={"gamma": [0.1]}),
        lambda: hz.bodies([1.0, 1.0], [[0.0, 0.0], [1.0, 0.0]], 0.0, 0.1, step=0.1, gamma=0.1),
        lambda: hz.lattice("x'^2/2 + gamma*z", None, [1.0, 0.0], 0.0, 0.1, step=0.1, **gain),
        lambda: hz.rigid_body((1, 2, 3), omega=(1, 1, 1), t=0.1, gamma=0.1),
    ]
    for call in calls:
        with pytest.warns(UserWarning, match=GAINS) as said:
            call()
        # At the line of the user, so that it is shown once for it.
        assert len(said) == 1 and said[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hz.solve(**GOOD)
        # A formula may have the other sign.
        hz.solve(**GOOD | gain | dict(L="x'^2/2 - x^2/2 - gamma*z"))
        hz.bodies([1.0, 1.0], [[0.0, 0.0], [1.0, 0.0]], 0.0, 0.1, step=0.1, gamma=-0.1)


def test_a_continued_motion_says_where_it_starts():
    sol = hz.solve(**GOOD)
    assert sol.sensitivity("x").t0 == 0.0 and sol.resume(2.0).sensitivity("x").t0 == 1.0
    assert hz.solve(**GOOD | dict(t=[0.5, 1.0])).sensitivity("x").t0 == 0.5
    with pytest.raises(ValueError, match="was given by its momentum.*with respect to the momentum"):
        sol.resume(2.0).sensitivity("x'")


def test_an_ensemble_says_the_same():
    many = dict(L=FORMULA, q0=np.ones((3, 1)), v0=np.zeros((3, 1)), t=1.0, coordinates=["x"], parameters={"gamma": -0.1})
    for change, said in [
        (dict(integrator="gauss_4", steps=1e3), "`steps` is 1000.0.*write 1000"),
        (dict(threads=0), "`threads` is 0; it must be an integer"),
        (dict(threads=2.0), "`threads` is 2.0.*write 2"),
        (dict(events=hz.Event("x", -1)), 'write "falling"'),
        (dict(observe=["x"]), "`observe`"),
        (dict(integrator="transformed_gauss_8", step=0.1), "not available for a formula or a function"),
    ]:
        with pytest.raises(ValueError, match=said) as caught:
            hz.ensemble(**(many | change))
        assert not [word for word in FOREIGN if word in str(caught.value)]


def test_a_check_says_the_same():
    with pytest.raises(ValueError, match="`places` is 2.5"):
        hz.check(**GOOD, places=2.5)


def test_a_comparison_leaves_out_what_could_be_taken():
    """Integrators that need a time transformation apply to no formula, and are not among those of Python."""
    found = hz.compare("x'^2/2 + x'^2*x^2/2", [0.1], [0.0], 0.1, coordinates=["x"])
    assert found.left_out
    for name, why in found.left_out.items():
        assert "clock" not in name and name in hz.integrators()
        assert not [word for word in FOREIGN if word in why], why
    assert not [name for name in hz.integrators() if "clock" in name]


def test_tables_and_polynomials_of_numpy_are_traced():
    knots, values = np.array([0.0, 0.5, 1.5, 2.0]), np.array([0.0, 1.0, -1.0, 3.0])
    for x in (-1.0, 0.0, 0.2, 0.5, 1.0, 1.99, 2.0, 5.0):
        def table(t, q, v, z):
            return v @ v / 2 + np.interp(q[0], knots, values) + np.interp(q[0], knots, values, left=-7.0, right=9.0)

        def polynomial(t, q, v, z):
            return v @ v / 2 + np.polyval([1.0, -2.0, 3.0], q[0])

        wanted = np.interp(x, knots, values) + np.interp(x, knots, values, left=-7.0, right=9.0)
        # A few roundings of numbers below ten.
        assert abs(hz.geometry(table, 0.0, [x], [0.0]).lagrangian - wanted) < 1e-14
        found = hz.geometry(polynomial, 0.0, [x], [0.0]).lagrangian
        assert abs(found - np.polyval([1.0, -2.0, 3.0], x)) <= 1e-14 * abs(found)
    # On a piecewise linear slope the motion is known: x = t^2/2 up to 1/2, and then with twice the force.
    slope = lambda t, q, v, z: v @ v / 2 + np.interp(q[0], [0.0, 0.5, 4.0], [0.0, 0.5, 7.5])
    sol = hz.solve(slope, [0.0], [0.0], 2.0, accuracy=1e-9)
    assert abs(sol.q[-1, 0] - (0.5 + 1.0 + 1.0)) < 1e-8
