"""An invalid argument raises a ValueError that names it."""

import herglotz as hz
import numpy as np
import pytest

FORMULA = "x'^2/2 - x^2/2 + gamma*z"
GOOD = dict(L=FORMULA, q0=[1.0], v0=[0.0], t=1.0, coordinates=["x"], parameters={"gamma": -0.1})

BAD = [
    (dict(q0=[1.0, 2.0]), "`q0` has 2 numbers"),
    (dict(v0=[1.0, 2.0]), "`v0` has 2 numbers"),
    (dict(q0=[[1.0]]), r"`q0` has the shape \[1, 1\]"),
    (dict(q0=[np.nan]), r"`q0\[0\]` is NaN"),
    (dict(v0=np.array([np.inf])), r"`v0\[0\]` is inf"),
    (dict(q0=["one"]), "`q0` has the dtype <U3"),
    (dict(q0=[1j]), "`q0` has the dtype complex128"),
    (dict(q0=[True]), "`q0` has the dtype bool"),
    (dict(q0=[[1.0], [1.0, 2.0]]), "`q0`"),
    (dict(q0=None), "`q0` is not given"),
    (dict(v0=None), "`v0` or `p0`"),
    (dict(p0=[1.0]), "`v0` or `p0`"),
    (dict(z0=np.nan), "`z0` is nan"),
    (dict(z0="a"), "`z0` is 'a'"),
    (dict(t=None), "`t` is not given"),
    (dict(t=[1.0]), "`t` must be"),
    (dict(t=[]), "`t` must be"),
    (dict(t=[0.0, 2.0, 1.0]), "time t = 2|out of order"),
    (dict(t=np.nan), "`t"),
    (dict(accuracy=0.0), "accuracy|error"),
    (dict(accuracy="high"), "`accuracy` is 'high'"),
    (dict(integrator="gaus_4"), 'unknown integrator "gaus_4"'),
    (dict(step=0.1), "`integrator`"),
    (dict(integrator="gauss_4", step=0.1, steps=3), "`step` and `steps`"),
    (dict(integrator="gauss_4", step=0.1, accuracy=1e-3), "`accuracy` and a step are both given"),
    (dict(integrator="gauss_4", step=0.0), "step"),
    (dict(parameters={}), "unknown name `gamma`"),
    (dict(parameters={"gamma": np.nan}), r"parameters\[\"gamma\"\]"),
    (dict(parameters={"gamma": "low"}), r"parameters\[\"gamma\"\]"),
    (dict(coordinates=["t"]), '"t" is reserved'),
    (dict(L="x'^2/2 + cos(y)"), r"line 1, column 14.*\n.*\n +\^"),
    (dict(L="x' + gamma*z"), "linear in x'"),
    (dict(L="pendulun"), "pendulum|unknown name"),
    (dict(L="x'^2/2 + 1/x", q0=[0.0], parameters={}), "not finite at the start"),
    (dict(events="y"), 'event "y": line 1, column 1'),
    (dict(events=[hz.Event("x", direction="up")]), '"up"'),
    (dict(events=[3]), "3 is not an expression"),
    (dict(observe={"a": "sin(x"}), 'the column "sin\\(x"'),
]


def test_the_good_one_runs():
    assert hz.solve(**GOOD).success


@pytest.mark.parametrize("change, message", BAD, ids=[str(change)[:40] for change, _ in BAD])
def test_a_bad_argument_is_named(change, message):
    with pytest.raises(ValueError, match=message):
        hz.solve(**(GOOD | change))


def test_what_is_no_lagrangian():
    with pytest.raises(TypeError, match="must be a function, a formula"):
        hz.solve(3.0, [1.0], [0.0], 1.0)


def test_parameters_that_do_not_exist_are_refused():
    def drag(t, q, v, z, gamma=-0.1):
        return v @ v / 2 - q @ q / 2 + gamma * z

    import sympy

    x, xdot, z, gamma = sympy.symbols("x xdot z gamma")
    expression = xdot**2 / 2 - x**2 / 2 + gamma * z
    cases = [
        (drag, dict(q0=[1.0], v0=[0.0]), {"gama": -5.0}),
        (FORMULA, dict(q0=[1.0], v0=[0.0], coordinates=["x"]), {"gamma": -0.1, "gama": -5.0}),
        ("pendulum", {}, {"gama": -5.0}),
        (expression, dict(q0=[1.0], v0=[0.0], coordinates=[x]), {"gamma": -0.1, "gama": -5.0}),
    ]
    for L, start, parameters in cases:
        with pytest.raises(ValueError, match="'gama' is not used in the Lagrangian.*did you mean 'gamma'"):
            hz.solve(L, t=1.0, parameters=parameters, **start)
    with pytest.raises(ValueError, match="'gama'"):
        hz.ensemble(drag, np.ones((3, 1)), np.zeros((3, 1)), 1.0, parameters={"gama": [-1.0, -2.0, -3.0]})
    # A parameter that is used only in an event or a column is accepted.
    sol = hz.solve(FORMULA, [1.0], [0.0], 9.0, coordinates=["x"], parameters={"gamma": -0.1, "level": 0.5}, events="x - level")
    assert len(sol.events[0].t) > 1


def test_a_solution_keeps_no_array_of_the_callers():
    q, v, t = np.array([1.0]), np.array([0.0]), np.array([0.0, 5.0, 10.0])
    sol = hz.solve(FORMULA, q, v, t, coordinates=["x"], parameters={"gamma": -0.1})
    before = sol(5.0).q[0]
    again = hz.solve(FORMULA, q, v, t, coordinates=["x"], parameters={"gamma": -0.1})
    q[0], v[0], t[:] = 2.0, 3.0, 7.0
    assert again(5.0).q[0] == before
    assert again.plan.steps == sol.plan.steps
