"""Solutions: dense output, continuation, pickling, tables."""

import pickle

import herglotz as hz
import numpy as np
import pytest

PENDULUM = "theta'^2/2 + cos(theta) + gamma*z"
NAMES = dict(coordinates=["theta"], parameters={"gamma": -0.1})


def pendulum(t, **more):
    return hz.solve(PENDULUM, [1.0], [0.0], t, **NAMES, **more)


@pytest.mark.parametrize(
    "way", [dict(accuracy=1e-10), dict(integrator="gauss_8", step=0.7), dict(integrator="strang", steps=300)]
)
def test_states_at_any_time_are_those_of_rows(way):
    times = np.sort(np.random.default_rng(1).uniform(0, 20, 40))
    times = np.concatenate([[0.0], times, [20.0]])
    rows, sol = pendulum(times, **way), pendulum(20.0, **way)
    shuffled = np.random.default_rng(2).permutation(len(times))
    found = sol(times[shuffled])
    for name in ("q", "v", "p", "z", "energy"):
        # The steps from the same nodes are the same, except for the initial guess of the iteration.
        assert np.allclose(getattr(found, name), getattr(rows, name)[shuffled], rtol=1e-12, atol=1e-13), name
    one = sol(times[7])
    assert one.q.shape == (1,) and np.isclose(one.q[0], rows.q[7, 0], rtol=1e-12)
    assert np.array_equal(sol([3.0, 3.0]).q[0], sol([3.0, 3.0]).q[1])


def test_states_of_a_motion_back():
    sol = pendulum(10.0, accuracy=1e-11)
    back = hz.solve(PENDULUM, sol.q[-1], sol.v[-1], [10.0, 0.0], z0=sol.z[-1], accuracy=1e-11, **NAMES)
    assert np.allclose(back([2.5, 7.1]).q, sol([2.5, 7.1]).q, rtol=1e-9)


def test_states_up_to_a_terminal_event():
    sol = pendulum(20.0, events=[hz.Event("theta", terminal=True)])
    assert abs(sol(sol.t_end).q[0]) < 1e-9
    with pytest.raises(ValueError, match="from 0 to"):
        sol(25.0)


def test_the_time_of_the_end_is_inside_to_rounding():
    for h in (0.1, 0.3, 0.7 / 3):
        sol = pendulum(2.1, integrator="gauss_4", step=h)
        for t in (sol.t[-1], np.nextafter(sol.t[-1], 9), np.nextafter(sol.t[0], -1)):
            assert abs(sol(t).q[0] - sol.q[0 if t < 1 else -1, 0]) < 1e-14
        with pytest.raises(ValueError):
            sol(2.1 + 1e-9)


def test_a_motion_to_its_start_is_the_start():
    for t in (0, [2.0, 2.0]):
        sol = pendulum(t, accuracy=1e-9)
        assert sol.success and sol.steps == 0 and len(sol.t) == 1
        assert sol.q[0, 0] == 1.0 and sol.v[0, 0] == 0.0 and sol(sol.t[0]).q[0] == 1.0
        onward = sol.resume(sol.t[0] + 1.0)
        assert onward.success and onward.t[0] == sol.t[0]


def test_the_velocity_is_that_of_the_motion():
    # p = sin(4) - t/10 and x' = pi - arcsin(p): many velocities x' correspond to each p.
    def p(t):
        return np.sin(4.0) - 0.1 * t

    def integral(p):
        return p * np.arcsin(p) + np.sqrt(1 - p * p)

    def x(t):
        return np.pi * t + 10 * (integral(p(t)) - integral(p(0)))

    sol = hz.solve("-cos(x') - 0.1*x", [0.0], [4.0], 1.0, coordinates=["x"], accuracy=1e-10, events=["x' - 4.1"])
    assert abs(sol(0.5).q[0] - x(0.5)) < 1e-9 and abs(sol(0.5).v[0] - (np.pi - np.arcsin(p(0.5)))) < 1e-9
    assert len(sol.events[0].t) == 1
    onward = sol.resume(2.0)
    assert abs(onward.q[-1, 0] - x(2.0)) < 1e-9 and abs(onward.v[-1, 0] - (np.pi - np.arcsin(p(2.0)))) < 1e-9


def test_a_motion_goes_on():
    whole, part = pendulum(30.0, accuracy=1e-11), pendulum(12.0, accuracy=1e-11, events=["theta"])
    rest = part.resume(np.array([15.0, 30.0]))
    assert np.allclose(rest.q[-1], whole.q[-1], rtol=1e-9) and np.allclose(rest.z[-1], whole.z[-1], rtol=1e-9)
    assert rest.t[0] == 12.0 and len(rest.t) == 3 and len(rest.events[0].t) > 0
    by_steps = pendulum(10.0, integrator="gauss_4", steps=20).resume(20.0)
    assert by_steps.steps == 20 and np.allclose(
        by_steps.q[-1], pendulum(20.0, integrator="gauss_4", steps=40).q[-1], rtol=1e-12
    )


def test_what_was_not_reached_is_gone_on_with():
    times = np.array([0.0, 1.0, 5.0, 10.0])
    part = pendulum(times, events=[hz.Event("theta", terminal=True)])
    assert 1.0 < part.t_end < 5.0
    rest = part.resume()
    # The event that ended the first part is at the start of the continuation, which ends at the next crossing.
    assert rest.t[0] == part.t_end and rest.t_end > part.t_end + 1
    with pytest.raises(ValueError, match="reached its end"):
        pendulum(times).resume()


def test_what_is_pickled_is_the_same():
    sol = pendulum(np.linspace(0, 10, 11), events={"zero": "theta"}, observe={"twice": "2*theta"})
    sol(3.0), sol.plan
    again = pickle.loads(pickle.dumps(sol))
    assert np.array_equal(again.q, sol.q) and np.array_equal(again["twice"], sol["twice"])
    assert np.array_equal(again.events["zero"].t, sol.events["zero"].t) and again.status == sol.status
    assert np.array_equal(again(3.3).q, sol(3.3).q) and again.resume(12.0).t_end == 12.0
    system = pickle.loads(pickle.dumps(hz.system(lambda t, q, v, z: v @ v / 2 - np.sin(q[0]) * z, n=1)))
    assert "sin(q[0])" in system.lagrangian


def test_tables_and_plots(tmp_path):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("Agg")
    sol = pendulum(np.linspace(0, 10, 11), observe={"twice": "2*theta"}, conformal_factor=True)
    frame = sol.to_pandas()
    assert np.array_equal(frame["theta'"], sol.v[:, 0]) and np.array_equal(frame.index, sol.t)
    data = sol.to_xarray()
    assert np.array_equal(data["q"].sel(coordinate="theta"), sol.q[:, 0]) and data["twice"].dims == ("t",)
    # Without axes of its own a plot continues the current ones, which another test may have left.
    pyplot.close("all")
    axes = sol.plot("theta", "twice")
    assert len(axes.lines) == 2
    axes.figure.savefig(tmp_path / "plot.png")
