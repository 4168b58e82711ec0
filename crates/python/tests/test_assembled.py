"""Lattices and bodies with more coordinates than the formula of a system can have."""

import os
import pickle
import signal
import threading

import herglotz as hz
import numpy as np
import pytest

SITE, BOND = "x'^2/2 - (1 - cos(x)) + gamma*z", "-(xr - xl)^2/2"


@pytest.fixture(autouse=True)
def signals_are_heard():
    """A background process of a script inherits an ignored SIGINT; this restores Python's handler."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def test_a_short_lattice_is_the_small_system():
    q0, t = np.array([0.3, -1.0, 0.5]), np.linspace(0, 2, 5)
    sol = hz.lattice(SITE, BOND, q0, 0.1, t, step=0.1, boundary="fixed", parameters={"gamma": -0.1}, conformal_factor=True)
    small = hz.solve(
        "sum(i, 0, 2, v[i]^2/2 - (1 - cos(q[i]))) - (q[0]^2 + (q[1]-q[0])^2 + (q[2]-q[1])^2 + q[2]^2)/2 + gamma*z",
        q0,
        [0.1] * 3,
        t,
        integrator="strang",
        step=0.1,
        parameters={"gamma": -0.1},
        conformal_factor=True,
    )
    for name in ("t", "q", "v", "p", "z", "energy", "log_factor"):
        # The bound is the round-off of twenty steps.
        assert np.abs(getattr(sol, name) - getattr(small, name)).max() < 1e-13, name
    assert (sol.status, sol.success, sol.steps, sol.t_end) == ("completed", True, 20, 2.0)


def test_a_plane_of_three_hundred_sites_with_two_components():
    rng = np.random.default_rng(1)
    q0 = rng.normal(size=(15, 20, 2))
    sol = hz.lattice(
        "x'^2/2 + y'^2/2 - (x^2 + y^2)^2/4 + gamma*z",
        "-((xr - xl)^2 + (yr - yl)^2)/2",
        q0,
        np.zeros_like(q0),
        np.linspace(0, 5, 11),
        integrator="blanes_moan_6",
        step=0.05,
        coordinates=["x", "y"],
        parameters={"gamma": -0.2},
    )
    assert sol.q.shape == sol.v.shape == sol.p.shape == (11, 15, 20, 2)
    assert np.array_equal(sol.q[0], q0) and sol.momenta == {}
    kinetic = (sol.p**2).sum(axis=(1, 2, 3)) / 2
    stretched = sum(((sol.q - np.roll(sol.q, 1, axis)) ** 2).sum(axis=(1, 2, 3)) for axis in (1, 2)) / 2
    energy = kinetic + stretched + ((sol.q**2).sum(axis=3) ** 2).sum(axis=(1, 2)) / 4 + 0.2 * sol.z
    # The energy is that of the formulas, up to the round-off of 600 terms, and decays as e^(gamma t), up to the error
    # of order 6.
    assert np.abs(energy / sol.energy - 1).max() < 1e-12
    assert np.abs(sol.energy * np.exp(0.2 * sol.t) / sol.energy[0] - 1).max() < 1e-7


def bodies(**given):
    rng = np.random.default_rng(2)
    n = 10
    asked = {"gamma": -0.05, "G": 0.1, "step": 0.02} | given
    return hz.bodies(rng.uniform(0.5, 1, n), 3 * rng.normal(size=(n, 3)), rng.normal(size=(n, 3)), 4.0, every=50, **asked)


def test_momenta_of_bodies_decay_with_the_rate():
    sol = bodies(conformal_factor=True)
    assert sol.q.shape == (5, 10, 3) and len(sol.momenta) == 6
    for name, momentum in sol.momenta.items():
        # The bound is the round-off of 200 steps.
        assert np.abs(momentum - momentum[0] * np.exp(-0.05 * sol.t)).max() < 1e-12, name
    assert np.abs(sol.log_factor + 0.05 * sol.t).max() < 1e-14


def test_a_motion_goes_on_and_back():
    sol = bodies()
    on = pickle.loads(pickle.dumps(sol)).resume(8.0)
    whole = bodies(step=0.02)
    assert on.t[0] == 4.0 and on.t_end == 8.0 and np.array_equal(on.q[0], whole.q[-1])
    back = on.resume(0.0)
    # Forward and backward with a symmetric method: the bound is round-off, amplified by the motion.
    assert back.t_end == 0.0 and np.abs(back.q[-1] - sol.q[0]).max() < 1e-9


def test_what_is_wrong_is_said_with_the_argument():
    q0 = np.zeros(20)
    good = dict(site=SITE, bond=BOND, q0=q0, v0=1.0, t=1.0, step=0.1, parameters={"gamma": -0.1})
    for change, message in [
        (dict(site="x'^2/2 - cos(y)"), "`site`: line 1, column 14: unknown name `y`"),
        (dict(bond="xl*x"), "`bond`: line 1"),
        (dict(parameters={"gamma": -0.1, "gama": 1.0}), "`parameters` has `gama`"),
        (dict(boundary="open"), '`boundary` is "open"'),
        (dict(integrator="gauss_8"), '`integrator` is "gauss_8", which is for up to 16 coordinates'),
        (dict(integrator="strnag"), "strnag"),
        (dict(step=None), "neither `step` nor `steps` is given"),
        (dict(steps=3), "`step` and `steps` are both given"),
        (dict(step=-0.1), "`step` is -0.1"),
        (dict(v0=np.zeros(19)), r"`v0` has the shape \(19,\), but `q0` has \(20,\)"),
        (dict(v0=None), "give either `v0` or `p0`"),
        (dict(q0=np.full(20, np.nan)), r"`q0\[0\]` is NaN"),
        (dict(q0="abc"), "`q0` must be an array of real numbers"),
        (dict(q0=None), "`q0` is not given"),
        (dict(t=None), "`t` is not given"),
        (dict(t=[0.0, 2.0, 1.0]), "the time t = 2 of row 1 is out of order"),
        (dict(every=0), "`every` is 0"),
        (dict(z0=np.inf), "`z0` is inf"),
        (dict(coordinates=["x", "y"]), "`q0` has the shape"),
    ]:
        with pytest.raises(ValueError, match=message):
            hz.lattice(**(good | change))
    with pytest.raises(ValueError, match=r"`q0` has the shape \(2, 3\); it must have a row for each of the 3 bodies"):
        hz.bodies([1, 1, 1], np.zeros((2, 3)), 0.0, 1.0, step=0.1)
    with pytest.raises(ValueError, match="`masses` has 0 for body 1"):
        hz.bodies([1, 0], np.eye(2), 0.0, 1.0, step=0.1)
    with pytest.raises(ValueError, match="the unknown 0 is not finite at the start|coincide"):
        hz.bodies([1, 1], np.zeros((2, 2)), 0.0, 1.0, step=0.1)


def test_ctrl_c_ends_a_run_and_keeps_what_was_computed():
    threading.Timer(0.4, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(hz.Interrupted) as caught:
        # The run would take some minutes.
        hz.lattice(SITE, BOND, np.zeros(10000), 1.0, 1e6, step=0.1, every=1000, parameters={"gamma": -1e-9})
    sol = pickle.loads(pickle.dumps(caught.value)).solution
    assert not sol.success and 0 < sol.t_end < 1e6
    assert sol.resume(sol.t_end + 0.1).success
