"""Error messages use the terms of the user and say what to write instead."""

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
