"""Holonomic constraints: texts and functions, starts, multipliers, and errors."""

import pickle

import herglotz as hz
import numpy as np
import pytest

# The period of a pendulum of length 1 that starts at rest at the height of its pivot.
PERIOD = 2.367841947576237
START = [1.0, 0.0], [0.0, 0.0]


def newton(t, q, v, z, g):
    return v @ v / 2 - g * q[1]


TEXT = dict(L="(x'^2 + y'^2)/2 - g*y", coordinates=["x", "y"])
WAYS = {
    "an equation": dict(TEXT, constraints="x^2 + y^2 = l^2"),
    "an expression": dict(TEXT, constraints=["x^2 + y^2 - l^2"]),
    "a function": dict(L=newton, constraints=lambda q, l: q @ q - l**2),
    "a function for a text": dict(TEXT, constraints=lambda q, l: np.array([q @ q - l**2])),
    "a text for a function": dict(L=newton, constraints="q[0]^2 + q[1]^2 = l^2"),
}


@pytest.mark.parametrize("way", WAYS)
def test_a_pendulum_returns_after_its_period(way):
    t = np.linspace(0, PERIOD, 50)
    sol = hz.solve(
        **WAYS[way], q0=START[0], v0=START[1], t=t, integrator="kahan_li_8", steps=200,
        parameters={"g": 9.81, "l": 1.0}, observe={"lambda": "lambda"},
    )
    # The velocity vanishes there: the error of the position is of the second order of that of the time.
    assert np.abs(sol.q[-1] - START[0]).max() < 1e-9
    tension = np.sum(sol.v**2, 1) - 9.81 * sol.q[:, 1]
    assert np.abs(sol["lambda"] + tension / 2).max() < 1e-9
    # Rows between steps and at any time are states of steps.
    for q in (sol.q, sol(np.linspace(0.1, 2.0, 7)).q):
        assert np.abs(np.sum(q**2, 1) - 1).max() < 1e-14


def test_integrators_are_chosen_and_continue():
    of = dict(TEXT, constraints="x^2 + y^2 = l^2", parameters={"g": 9.81, "l": 1.0})
    sol = hz.solve(**of, q0=START[0], v0=START[1], t=PERIOD / 2, accuracy=1e-10)
    assert sol.plan.integrator == "rattle_kahan_li_8"
    assert np.abs(sol(PERIOD / 4).q @ [1, 1] + 1) < 1e-8  # the lowest point (0, -1)
    on = sol.resume(PERIOD)
    assert np.abs(on.q[-1] - START[0]).max() < 1e-8
    system = pickle.loads(pickle.dumps(sol.system))
    assert system.constraints == ["x^2 + y^2 = l^2"] and repr(system) == repr(sol.system)
    again = hz.solve(system, *START, PERIOD / 2, integrator="gauss_4", steps=100)
    assert np.abs(again.q[-1] - sol.q[-1]).max() < 1e-8 and again.plan.integrator == "lobatto_5"
    found = hz.ensemble(system, [START[0]] * 2, [START[1]] * 2, PERIOD / 2, integrator="gauss_4", steps=100)
    assert np.array_equal(found.q[0], again.q[-1])


def test_starts_off_the_constraints():
    of = dict(TEXT, constraints="x^2 + y^2 = 1", parameters={"g": 9.81}, integrator="strang", steps=10)
    with pytest.raises(ValueError, match="off the constraints by the distance 4.97"):
        hz.solve(**of, q0=[1.0, 0.1], v0=[0.0, 0.0], t=0.1)
    with pytest.raises(ValueError, match="initial velocity violates the constraints"):
        hz.solve(**of, q0=[1.0, 0.0], v0=[1.0, 0.0], t=0.1)
    sol = hz.solve(**of, q0=[1.0, 0.1], v0=[1.0, 0.0], t=[0.0, 0.1], project=True)
    assert np.abs(np.sum(sol.q**2, 1) - 1).max() < 1e-14


@pytest.mark.parametrize(
    "constraints, message",
    [
        ("x^2 + v[0]", "not on velocities"),
        ("x = t", "does not depend on time"),
        ("x - tta", "unknown name `tta`"),
        (["x = 1", "y = 1"], "fewer constraints"),
        (3.0, "it must be a formula"),
        (lambda q: abs(q[0]) - 1, "kink"),
        (lambda q, m: q[0] - m, "'m' of <lambda> has no value"),
    ],
)
def test_what_is_no_constraint(constraints, message):
    with pytest.raises(ValueError, match=message):
        hz.system(**TEXT, parameters={"g": 9.81}, constraints=constraints)


def test_steps_with_constraints_are_contact():
    of = hz.system(**TEXT, parameters={"g": 9.81}, constraints="x^2 + y^2 = 1")
    for integrator in ("gauss_2", "suzuki_4"):
        check = hz.check(of, *START, 1.0, integrator=integrator, steps=20)
        assert check.is_contact and max(place.contact_defect for place in check.places) < 1e-9


def test_what_is_not_computed_with_constraints():
    of = hz.system(**TEXT, parameters={"g": 9.81}, constraints="x^2 + y^2 = 1")
    with pytest.raises(ValueError, match="not computed with constraints"):
        hz.path(of, [1.0, 0.0], [0.0, 1.0], 1.0, steps=10)
    with pytest.raises(ValueError, match="RATTLE"):
        hz.solve(of, *START, 1.0, integrator="midpoint", steps=10)
