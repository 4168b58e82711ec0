"""Motions between two positions: compared with the exact oscillator, and with motions from the states found."""

import herglotz as hz
import numpy as np
import pytest

GAMMA = -0.2
OSCILLATOR = dict(L="x'^2/2 - x^2/2 + gamma*z", coordinates=["x"], parameters={"gamma": GAMMA})


def exact(t, x1, t1):
    """The solution of x'' = -x + gamma x' from 0 to x1 at t1, and its velocity."""
    w = np.sqrt(1 - GAMMA**2 / 4)
    a = x1 / (np.exp(GAMMA * t1 / 2) * np.sin(w * t1))
    x = a * np.exp(GAMMA * t / 2) * np.sin(w * t)
    return x, a * np.exp(GAMMA * t / 2) * (GAMMA / 2 * np.sin(w * t) + w * np.cos(w * t))


@pytest.mark.parametrize("integrator, error", [("gauss_8", 1e-13), ("gauss_4", 1e-11), ("midpoint", 6e-4), ("trapezoidal", 6e-4)])
def test_the_oscillator_between_two_positions(integrator, error):
    """The bounds are the orders: h^8 for collocation with four stages, and h^2/4 times about one for the rules."""
    found = hz.path(q0=[0.0], q1=[1.0], t=2.0, steps=40, integrator=integrator, **OSCILLATOR)
    assert found.found and bool(found) and found.status == "found" and found.iterations >= 1
    x, v = exact(found.t, 1.0, 2.0)
    assert found.q.shape == found.p.shape == (41, 1) and found.z.shape == (41,)
    assert np.max(np.abs(found.q[:, 0] - x)) < error and np.max(np.abs(found.p[:, 0] - v)) < 10 * error
    assert (found.q[0, 0], found.q[-1, 0], found.z[0]) == (0.0, 1.0, 0.0)
    # The conformal factor for a constant rate.
    assert found.log_factor == pytest.approx(GAMMA * 2.0, abs=1e-3)
    motion = hz.solve(q0=[0.0], v0=[v[0]], t=2.0, accuracy=1e-12, **OSCILLATOR)
    assert found.action == pytest.approx(motion.z[-1], abs=10 * error)


def test_a_path_goes_on_as_a_motion():
    L = lambda t, q, v, z, k: v @ v / 2 - k * np.sum(q**4) / 4 + q[0] * q[1] - 0.1 * z
    found = hz.path(L, [0.1, 0.4], [0.5, -0.2], (1.0, 2.5), steps=30, integrator="gauss_6", z0=0.3, parameters={"k": 0.7})
    assert found and found.t[0] == 1.0 and found.t[-1] == 2.5
    motion = hz.solve(L, found.q[0], p0=found.p[0], t=found.t, z0=0.3, accuracy=1e-12, parameters={"k": 0.7})
    # Both are the same motion, up to the error of order 12 with steps of 0.05 and the residual of Newton's method.
    assert np.max(np.abs(motion.q - found.q)) < 1e-10 and np.max(np.abs(motion.z - found.z)) < 1e-10


def test_a_search_that_finds_nothing_says_so():
    """With ends half a period apart the undamped oscillator has no path to another position: the ends are conjugate."""
    free = OSCILLATOR | dict(parameters={"gamma": 0.0})
    # The exact time that midpoint steps take for half a period.
    steps = 40
    h = 2 * np.tan(np.pi / (2 * steps))
    missed = hz.path(q0=[0.0], q1=[1.0], t=steps * h, steps=steps, integrator="midpoint", **free)
    assert not missed.found and not missed and missed.status != "found"


def test_a_guess_leads_to_another_path():
    """With a suitable guess, the pendulum swings out and returns to the lower equilibrium."""
    pendulum = dict(L="theta'^2/2 + cos(theta)", coordinates=["theta"])
    straight = hz.path(q0=[0.0], q1=[0.0], t=8.0, steps=80, **pendulum)
    t = np.linspace(0.0, 1.0, 81)
    swung = hz.path(q0=[0.0], q1=[0.0], t=8.0, steps=80, guess=2.0 * np.sin(np.pi * t).reshape(-1, 1), **pendulum)
    assert straight and np.all(straight.q == 0.0)
    assert swung and np.max(np.abs(swung.q)) > 0.5


@pytest.mark.parametrize(
    "way",
    [
        dict(force="-k*x'*abs(x')"),
        dict(force=lambda t, q, v, z, k: -k * v * np.abs(v)),
        dict(rayleigh="k*abs(x')^3/3"),
    ],
)
def test_a_fall_with_quadratic_drag(way):
    """From rest it covers ln(cosh(sqrt(g k) t))/k; the error of a rule of order two with h = 0.01."""
    g, k = 9.81, 0.3
    distance = lambda t: np.log(np.cosh(np.sqrt(g * k) * t)) / k
    given = dict(coordinates=["x"], parameters={"k": k}, steps=200, **way)
    found = hz.path("x'^2/2 + 9.81*x", [0.0], [distance(2.0)], 2.0, integrator="midpoint", **given)
    error = np.max(np.abs(found.q[:, 0] - distance(found.t)))
    assert found and found.unresolved is None and error < 1e-3
    assert 0.5 * error < found.error_estimate * distance(2.0) < 2.0 * error
    with pytest.raises(ValueError, match="gauss_4.*no discrete Lagrangian with forces.*midpoint"):
        hz.path("x'^2/2 + 9.81*x", [0.0], [distance(2.0)], 2.0, **given)


def test_bad_arguments_are_named():
    good = dict(q0=[0.0], q1=[1.0], t=2.0, steps=40) | OSCILLATOR
    for change, said in [
        (dict(q1=[1.0, 2.0]), "`q1` has 2 numbers"),
        (dict(q0=[0.0, 1.0]), "`q0` has 2 numbers"),
        (dict(steps=1), "`steps` is 1; it must be an integer of at least 2"),
        (dict(steps=4e1), "`steps` is 40.0.*write 40"),
        (dict(integrator="blanes_moan_6"), "no discrete Lagrangian.*gauss_4"),
        (dict(integrator="gauss_99"), "gauss_99"),
        (dict(t=(0.0, 1.0, 2.0)), "`t` is"),
        (dict(t=0.0), "step"),
        (dict(guess=np.zeros((3, 1))), "40 . 1 points"),
        (dict(z0=np.nan), "`z0` is nan"),
    ]:
        with pytest.raises(ValueError, match=said):
            hz.path(**(good | change))


def test_a_path_that_is_found_says_what_it_is_worth():
    """A free oscillator: the error is estimated away from half a period; there the path is flagged, for any steps."""
    free = OSCILLATOR | dict(parameters={"gamma": 0.0})
    for steps in (50, 500):
        good = hz.path(q0=[0.0], q1=[1.0], t=2.0, steps=steps, integrator="midpoint", **free)
        error = np.max(np.abs(good.q[:, 0] - np.sin(good.t) / np.sin(2.0)))
        assert good and good.unresolved is None and good.regularity > 0.0
        # The estimate is of first order.
        assert 0.5 * error < good.error_estimate < 2.0 * error
        conjugate = hz.path(q0=[0.0], q1=[1.0], t=np.pi, steps=steps, integrator="midpoint", **free)
        assert np.max(np.abs(conjugate.q)) > 100.0
        assert not conjugate or "does not resolve" in conjugate.unresolved and conjugate.error_estimate > 0.25
    # For higher orders the truncation error is not estimated.
    assert hz.path(q0=[0.0], q1=[1.0], t=2.0, steps=20, integrator="gauss_4", **free).error_estimate is None
