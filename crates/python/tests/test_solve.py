"""Motions compared with closed forms and with each other."""

import herglotz as hz
import numpy as np
import pytest

OSCILLATOR = dict(coordinates=["x"], parameters={"gamma": -0.1})
FORMULA = "x'^2/2 - x^2/2 + gamma*z"


def oscillator(t, gamma=-0.1):
    """x and x' of the damped oscillator that starts at 1, at rest."""
    a = gamma / 2
    w = np.sqrt(1 - a * a)
    x = np.exp(a * t) * (np.cos(w * t) - a / w * np.sin(w * t))
    return x, -np.exp(a * t) * np.sin(w * t) / w


def test_a_formula_follows_the_closed_form():
    t = np.linspace(0, 50, 501)
    sol = hz.solve(FORMULA, [1.0], [0.0], t, accuracy=1e-11, **OSCILLATOR)
    x, v = oscillator(t)
    # The size of the motion decays by e^-2.5; the requested error is 1e-11 of it.
    assert np.max(np.abs(sol.q[:, 0] - x)) < 1e-11
    assert np.max(np.abs(sol.v[:, 0] - v)) < 1e-11
    assert sol.status == "completed" and sol.success and sol.unresolved is None
    assert sol.t_end == 50.0 and sol.steps > 0
    assert np.array_equal(sol.t, t)
    assert sol.q.shape == sol.v.shape == sol.p.shape == (501, 1) and sol.z.shape == sol.energy.shape == (501,)


def test_the_energy_is_that_of_the_rows():
    sol = hz.solve(FORMULA, [1.0], [0.0], 10.0, **OSCILLATOR)
    energy = sol.v[:, 0] ** 2 / 2 + sol.q[:, 0] ** 2 / 2 + 0.1 * sol.z
    assert np.allclose(sol.energy, energy, rtol=1e-14, atol=1e-15)


def test_a_motion_back_is_the_motion():
    sol = hz.solve(FORMULA, [1.0], [0.0], 20.0, accuracy=1e-11, **OSCILLATOR)
    back = hz.solve(FORMULA, sol.q[-1], sol.v[-1], [20.0, 10.0, 0.0], z0=sol.z[-1], accuracy=1e-11, **OSCILLATOR)
    assert np.max(np.abs(back.q[:, 0] - oscillator(np.array([20.0, 10.0, 0.0]))[0])) < 1e-10
    assert abs(back.z[-1]) < 1e-10


@pytest.mark.parametrize("name, order", [("midpoint", 2), ("gauss_2", 4), ("strang", 2)])
def test_integrators_by_name_have_their_order(name, order):
    assert hz.integrators()[name] == order

    def error(steps):
        sol = hz.solve(FORMULA, [1.0], [0.0], 5.0, integrator=name, steps=steps, **OSCILLATOR)
        assert sol.steps == steps and sol.plan.integrator == name
        return abs(sol.q[-1, 0] - oscillator(5.0)[0])

    slope = np.log2(error(40) / error(80))
    assert abs(slope - order) < 0.15


def test_a_step_by_its_length():
    sol = hz.solve(FORMULA, [1.0], [0.0], 5.0, integrator="gauss_4", step=0.5, every=2, **OSCILLATOR)
    assert sol.steps == 10 and np.allclose(sol.t, np.arange(6.0))


def test_events_are_where_the_closed_form_has_them():
    events = {"zero": "x", "turn": hz.Event("x'", direction="rising")}
    sol = hz.solve(FORMULA, [1.0], [0.0], 20.0, accuracy=1e-11, events=events, **OSCILLATOR)
    w = np.sqrt(1 - 0.05**2)
    zeros = (np.arctan2(w, -0.05) + np.arange(6) * np.pi) / w
    # The zeros of x in closed form: cos(wt) + 0.05/w sin(wt) = 0.
    zeros = np.array([t for t in zeros if t < 20.0])
    assert np.allclose(sol.events["zero"].t, zeros, atol=1e-9)
    # x' = -e^(at) sin(wt)/w rises through 0 at odd multiples of pi/w.
    assert np.allclose(sol.events["turn"].t, np.pi / w * np.array([1, 3, 5]), atol=1e-9)
    assert sol.events["turn"].q.shape == (3, 1) and np.max(np.abs(sol.events["turn"].v)) < 1e-9


def test_a_terminal_event_ends_the_motion():
    sol = hz.solve(FORMULA, [1.0], [0.0], 20.0, events=[hz.Event("x", terminal=True)], **OSCILLATOR)
    assert len(sol.events[0].t) == 1 and sol.t_end == sol.events[0].t[0] < 2.0
    assert sol.success and sol.status.startswith("stopped")


def test_columns_are_expressions_and_functions():
    columns = {"scaled": "exp(-gamma*t)*x", "again": lambda t, q, v, z, gamma: np.exp(-gamma * t) * q[0]}
    sol = hz.solve(FORMULA, [1.0], [0.0], np.linspace(0, 5, 11), observe=columns, **OSCILLATOR)
    wanted = np.exp(0.1 * sol.t) * sol.q[:, 0]
    assert np.allclose(sol["scaled"], wanted, rtol=1e-14) and np.allclose(sol["again"], wanted, rtol=1e-14)
    assert np.array_equal(sol["x'"], sol.v[:, 0])
    with pytest.raises(KeyError, match="observe"):
        sol["y"]


def test_the_momenta_of_bodies_in_a_formula():
    two = "(2*(a'^2 + b'^2) + 3*(c'^2 + d'^2))/2 + 6/hypot(a - c, b - d) - 0.05*z"
    sol = hz.solve(
        two,
        [1.0, 0.2, -1.0, 0.1],
        [0.1, 0.5, 0.2, -0.5],
        [0.0, 1.0, 2.0],
        coordinates=["a", "b", "c", "d"],
        accuracy=1e-11,
    )
    assert list(sol.momenta) == ["translation of a, c", "translation of b, d", "rotation of (a, b), (c, d)"]
    for name, momentum in sol.momenta.items():
        # Accurate relative to the momentum of a single body.
        assert np.allclose(momentum, momentum[0] * np.exp(-0.05 * sol.t), rtol=0, atol=1e-9), name
    assert np.array_equal(sol.momenta["translation of a, c"], sol.p[:, 0] + sol.p[:, 2])


def test_the_conformal_factor_and_the_momenta():
    sol = hz.solve("kepler", t=np.linspace(0, 10, 5), conformal_factor=True, accuracy=1e-11)
    assert np.allclose(sol.log_factor, -0.01 * sol.t, atol=1e-13)
    momentum = sol.momenta["rotation of x, y"]
    assert np.allclose(momentum * np.exp(-sol.log_factor), momentum[0], rtol=1e-11)
    assert hz.solve("kepler", t=1.0).log_factor is None


def test_evaluations_are_counted():
    sol = hz.solve("pendulum", t=5.0, integrator="gauss_4", steps=10)
    assert sol.steps == 10 and sol.evaluations >= 40


def test_a_plan_is_in_words():
    plan = hz.solve(FORMULA, [1.0], [0.0], 5.0, accuracy=1e-8, **OSCILLATOR).plan
    assert "the structure is proved from the formula" in str(plan) and plan.integrator in str(plan)
    assert plan.steps > 0 and plan.error < 1e-8


def test_a_start_by_its_momentum():
    heavy = hz.system("m*x'^2/2 - x^2/2", ["x"], {"m": 2.0})
    by_v = hz.solve(heavy, [1.0], [0.5], 3.0)
    by_p = hz.solve(heavy, [1.0], t=3.0, p0=[1.0])
    assert np.allclose(by_v.q, by_p.q, rtol=1e-12)


def test_a_system_with_other_parameters():
    system = hz.System(FORMULA, ["x"], {"gamma": -0.1})
    assert system.with_parameters({"gamma": -0.3}).parameters == {"gamma": -0.3}
    sol = hz.solve(system, [1.0], [0.0], 5.0, parameters={"gamma": -0.3})
    assert abs(sol.q[-1, 0] - oscillator(5.0, -0.3)[0]) < 1e-8
    assert set(system.structure) >= {"quadratic", "separable", "autonomous"}


def test_arrays_are_not_copies():
    sol = hz.solve(FORMULA, [1.0], [0.0], np.linspace(0, 5, 11), **OSCILLATOR)
    assert sol.q.base is not None or sol.q.flags.owndata is False
    assert sol.q.flags.c_contiguous and sol.q.dtype == np.float64


def test_every_name_of_the_catalogue_runs():
    # From t = 1, since one system is singular at t = 0.
    for name in hz.catalogue():
        system = hz.solve(name, t=[1.0, 1.5]).system
        assert hz.solve(name, t=[1.0, 1.5]).success, system


def test_the_error_of_given_steps_is_estimated():
    end = 20.0
    for integrator, step in [("strang", 0.1), ("gauss_2", 0.5), ("midpoint", 0.05)]:
        sol = hz.solve(FORMULA, [1.0], [0.0], [0, end], integrator=integrator, step=step, estimate=True, **OSCILLATOR)
        x, v = oscillator(end)
        # The conjugate momentum equals the velocity.
        error = np.hypot(sol.q[-1, 0] - x, sol.p[-1, 0] - v) / np.hypot(x, v)
        # For a method of order p, the distance from the run with half steps is 1 - 2^-p of the error: at least three
        # quarters.
        assert 0.7 * error < sol.error_estimate < 1.3 * error
    assert hz.solve(FORMULA, [1.0], [0.0], [0, end], integrator="strang", step=0.1, **OSCILLATOR).error_estimate is None


def test_the_velocity_is_as_accurate_as_the_state():
    # A charge in a magnetic field: v rotates by the angle B t, and p = v + A(q) is 1e5 times as large.
    B, t = 1e5, 40e-5
    formula, plane = "(x'^2 + y'^2)/2 + B*(x*y' - y*x')/2", dict(coordinates=["x", "y"], parameters={"B": B})
    sol = hz.solve(formula, [1.0, 0.0], [0.6, 0.8], t, accuracy=1e-6, **plane)
    turn = 0.6 - 0.8j
    expected = turn * np.exp(1j * B * t)
    assert abs(complex(sol.v[-1, 0], -sol.v[-1, 1]) - expected) < 1e-6


def test_coordinates_of_different_size_have_their_own_scales():
    formula, start = "(x'^2 + y'^2 - x^2 - (1 + 900*x^2)*y^2)/2", ([0.0, 1e-8], [1.0, 0.0])
    plane = dict(coordinates=["x", "y"])
    exact = hz.solve(formula, *start, 5.0, integrator="gauss_16", step=0.01, **plane)

    def error(**options):
        sol = hz.solve(formula, *start, 5.0, accuracy=1e-6, **plane, **options)
        return abs(sol.q[-1, 1] - exact.q[-1, 1]) / 1e-8

    assert error(scales=[1.0, 1e-8]) < 1e-6 < error()
    for scales, message in [([1.0], "has 1 numbers"), ([1.0, 0.0], "positive"), ([1.0, "a"], "scales")]:
        with pytest.raises(ValueError, match=message):
            error(scales=scales)


@pytest.mark.parametrize("n", range(1, 10))
def test_scales_are_taken_for_any_number_of_coordinates(n):
    """Also where they are computed with additional coordinates at rest."""
    names = [f"x{i}" for i in range(n)]
    L = " + ".join(f"{name}'^2/2 - {name}^2/2" for name in names)
    sol = hz.solve(L, np.ones(n), np.zeros(n), 1.0, coordinates=names, scales=np.full(n, 2.0), accuracy=1e-9)
    assert np.abs(sol.q[-1] - np.cos(1.0)).max() < 1e-8
