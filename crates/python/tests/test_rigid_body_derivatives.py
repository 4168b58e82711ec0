"""Derivatives of motions of rigid bodies, against differences of runs."""

import herglotz as hz
import numpy as np
import pytest

TOP = dict(inertia=[[1.0, 0.1, 0.0], [0.1, 1.4, -0.05], [0.0, -0.05, 0.7]], mass=0.8, centre=(0.1, -0.2, 0.5), gravity=(0.3, 0.0, -2.0), gamma=-0.1)
OMEGA, T = np.array([0.3, -0.2, 2.0]), [0.0, 0.5, 0.93, 1.5]
WAY = dict(integrator="gauss_4", step=0.05)
EVENTS = ["tip_y + 0.2*t - 0.05", "omega1 + q_x/3 - 0.5"]
INERTIA = {"inertia11": (0, 0), "inertia12": (0, 1), "inertia13": (0, 2), "inertia22": (1, 1), "inertia23": (1, 2), "inertia33": (2, 2)}
PARTS = "attitude", "Pi", "omega", "M", "tip", "energy", "z"


def moved(name, by):
    """The motion with a variable changed."""
    given, omega, z0, q0 = {k: np.array(v, dtype=float) for k, v in TOP.items()}, OMEGA.copy(), 0.2, np.array([1.0, 0, 0, 0])
    if name in INERTIA:
        i, j = INERTIA[name]
        given["inertia"][i, j] += by
        given["inertia"][j, i] = given["inertia"][i, j]
    elif name.startswith("turn"):
        q0[int(name[-1])] = np.sin(by / 2)
        q0[0] = np.cos(by / 2)
    elif name.startswith("omega"):
        omega[int(name[-1]) - 1] += by
    elif name == "z":
        z0 += by
    elif name[-1].isdigit():
        given[name[:-1]][int(name[-1]) - 1] += by
    else:
        given[name] += by
    given = {k: float(v) if v.ndim == 0 else v for k, v in given.items()}
    return hz.solve(hz.body(**given), q0=q0, v0=omega, z0=z0, t=T, events=EVENTS, **WAY)


def difference(of, name):
    """A difference of fourth order."""
    h = 1e-3
    a, b, c, d = (of(moved(name, by)) for by in (-2 * h, -h, h, 2 * h))
    return (a - 8 * b + 8 * c - d) / (12 * h)


VARIABLES = ["turn1", "turn3", "omega2", "z", *INERTIA, "mass", "centre1", "centre3", "gravity1", "gravity3", "gamma"]


@pytest.mark.parametrize("name", VARIABLES)
def test_rows_and_times_of_events(name):
    sol = moved(name, 0.0)
    found = sol.sensitivity(name)
    for part in PARTS:
        assert np.allclose(getattr(found, part), difference(lambda sol: getattr(sol, part), name), rtol=0, atol=2e-9), part
    assert all(len(event.t) for event in sol.events)
    for k, slopes in enumerate(found.event_times):
        # The differences have the error of the times of events.
        assert np.allclose(slopes, difference(lambda sol: sol.events[k].t, name), rtol=1e-6, atol=1e-7)
    # The same as the derivatives of the end that `rigid_body` has.
    both = sol.sensitivity([name, "gamma"])
    assert both.tip.shape == (4, 3, 2) and np.array_equal(both.tip[..., 0], found.tip) and np.array_equal(both.end.M, both.M[-1])


def test_gradients():
    sol = moved("z", 0.0)
    rng = np.random.default_rng(1)
    q, v, p, z = rng.normal(size=(4, 3)), rng.normal(size=(4, 3)), rng.normal(size=(4, 3)), rng.normal(size=4)
    gradient = sol.pullback(q=q, v=v, p=p, z=z)
    for name in VARIABLES:
        by = sol.sensitivity(name)
        expected = (q * by.turn).sum() + (v * by.omega).sum() + (p * by.Pi).sum() + z @ by.z
        start = {"turn": gradient.q0, "omega": gradient.v0}.get(name[:-1])
        found = gradient.z0 if name == "z" else gradient.parameters[name] if start is None else start[int(name[-1]) - 1]
        assert found == pytest.approx(expected, rel=1e-12)


def test_a_loss():
    loss = hz.value_and_grad("tip_z^2 + t*omega1 + z")
    given = dict(q0=[1.0, 0, 0, 0], v0=OMEGA, z0=0.2, integrator="gauss_6")
    # A step of the same length for all spans, so that the final time is differentiated with steps of the same number.
    value, gradient = loss(hz.body(**TOP), **given, t=[0.1, 1.1], steps=40)

    def of(t):
        return loss(hz.body(**TOP), **given, t=t, steps=40)[0]

    h = 1e-4
    assert gradient.t_end == pytest.approx((of([0.1, 1.1 + h]) - of([0.1, 1.1 - h])) / (2 * h), rel=1e-6)
    assert gradient.t0 == pytest.approx((of([0.1 + h, 1.1]) - of([0.1 - h, 1.1])) / (2 * h), rel=1e-6)
    heavier = hz.value_and_grad("tip_z^2 + t*omega1 + z")
    up, down = (heavier(hz.body(**TOP | dict(mass=0.8 + by)), **given, t=[0.1, 1.1], steps=40)[0] for by in (h, -h))
    assert gradient.parameters["mass"] == pytest.approx((up - down) / (2 * h), rel=1e-6)
    sol = hz.solve(hz.body(**TOP), **given, t=[0.1, 1.1], steps=40)
    assert value == pytest.approx(sol.tip[-1, 2] ** 2 + 1.1 * sol.omega[-1, 0] + sol.z[-1], rel=1e-14)


def test_an_end_at_an_event_moves():
    event = hz.Event("tip_z - 0.35*t", terminal=True)

    def run(gamma=-0.1):
        return hz.solve(hz.body(**TOP | dict(gamma=gamma)), v0=OMEGA, t=[0.0, 5.0], events=event, **WAY)

    sol, h = run(), 1e-3
    assert sol.success and sol.t_end < 5.0
    found, up, down = sol.sensitivity("gamma"), run(-0.1 + h), run(-0.1 - h)
    assert found.event_times[0][0] == pytest.approx((up.t_end - down.t_end) / (2 * h), abs=1e-6)
    assert np.allclose(found.end.tip, (up.end.tip[0] - down.end.tip[0]) / (2 * h), rtol=0, atol=1e-6)


def test_refusals():
    sol = hz.solve(hz.body((1, 2, 3)), v0=OMEGA, t=1.0)
    with pytest.raises(ValueError, match="derivatives take a Gauss method"):
        sol.sensitivity("gamma")
    sol = moved("z", 0.0)
    with pytest.raises(ValueError, match="'x' is no variable of a rigid body: the variables are turn1"):
        sol.sensitivity("x")
    with pytest.raises(ValueError, match="`q` has the shape"):
        sol.pullback(q=np.ones(4))
    with pytest.raises(ValueError, match="the loss of a rigid body is a text"):
        hz.value_and_grad(lambda t, q, v, z: q[0])(hz.body((1, 2, 3)), v0=OMEGA, t=1.0)
    with pytest.raises(ValueError, match="unknown name `x`"):
        hz.value_and_grad("x")(hz.body((1, 2, 3)), v0=OMEGA, t=1.0, **WAY)
