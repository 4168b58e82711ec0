"""Ensembles: compared with single motions; threads, processes, failures."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import herglotz as hz
import joblib
import numpy as np
import pytest

PENDULUM = "theta'^2/2 + cos(theta) + gamma*z"
NAMES = ["theta"]


def starts(count):
    rng = np.random.default_rng(3)
    return rng.uniform(-2, 2, (count, 1)), rng.uniform(-1, 1, (count, 1))


def test_members_are_single_motions():
    q, v = starts(50)
    many = hz.ensemble(PENDULUM, q, v, 10.0, accuracy=1e-10, coordinates=NAMES, parameters={"gamma": -0.1})
    assert many.q.shape == (50, 1) and many.z.shape == (50,) and many.success.all() and not many.troubles
    for i in (0, 17, 49):
        one = hz.solve(PENDULUM, q[i], v[i], 10.0, accuracy=1e-12, coordinates=NAMES, parameters={"gamma": -0.1})
        assert np.allclose(many.q[i], one.q[-1], atol=1e-9) and np.isclose(many.z[i], one.z[-1], atol=1e-9)


def test_parameters_and_rows_differ():
    q, v = starts(20)
    gamma = np.linspace(-1, 0, 20)
    t = np.linspace(0, 5, 6)
    wanted = dict(accuracy=1e-10, coordinates=NAMES)
    many = hz.ensemble(
        PENDULUM, q, v, t, parameters={"gamma": gamma}, z0=np.arange(20.0), observe={"e": "exp(gamma*t)"}, **wanted
    )
    assert many.q.shape == (20, 6, 1) and many["e"].shape == (20, 6)
    for i in (0, 7, 19):
        one = hz.solve(PENDULUM, q[i], v[i], t, z0=float(i), parameters={"gamma": gamma[i]}, **wanted)
        assert np.allclose(many.q[i], one.q, atol=1e-9) and np.allclose(many.z[i], one.z, atol=1e-8)
        assert np.allclose(many["e"][i], np.exp(gamma[i] * t))


def test_the_number_of_threads_does_not_matter():
    q, v = starts(1000)
    run = lambda threads: hz.ensemble(
        PENDULUM,
        q,
        v,
        3.0,
        integrator="gauss_8",
        step=0.25,
        threads=threads,
        coordinates=NAMES,
        parameters={"gamma": -0.1},
    )
    assert np.array_equal(run(1).q, run(3).q)


def test_a_member_that_fails_is_told():
    fall = "x'^2/2 + 1/x"
    q = np.array([[1.0], [0.0], [2.0]])
    many = hz.ensemble(fall, q, np.zeros((3, 1)), 0.5, integrator="gauss_4", step=0.05, coordinates=["x"])
    assert list(many.success) == [True, False, True] and set(many.troubles) == {1}
    assert np.isnan(many.q[1]).all() and np.isfinite(many.q[[0, 2]]).all()


def test_events_of_members_are_those_of_single_motions():
    gamma = np.array([-0.2, 0.0, -0.05])
    q, v = np.array([[1.0], [-0.5], [2.0]]), np.zeros((3, 1))
    wanted = dict(accuracy=1e-10, coordinates=NAMES)
    for events in (
        {"up": hz.Event("theta", "rising"), "slow": "theta' - gamma*theta"},
        hz.Event("theta", "falling", terminal=True),
    ):
        many = hz.ensemble(PENDULUM, q, v, 20.0, parameters={"gamma": gamma}, events=events, **wanted)
        assert many.success.all() and not many.troubles
        for i in range(3):
            one = hz.solve(PENDULUM, q[i], v[i], 20.0, parameters={"gamma": gamma[i]}, events=events, **wanted)
            # A motion that ends at an event has no row there.
            end = one.q[-1] if isinstance(events, dict) else one.events[0].q[-1]
            assert many.t[i] == one.t_end and np.array_equal(many.q[i], end)
            for name in events if isinstance(events, dict) else (0,):
                ours, alone = many.events[name], one.events[name]
                mine = ours.member == i
                assert mine.sum() == len(alone.t) > 0
                assert np.array_equal(ours.t[mine], alone.t) and np.array_equal(ours.v[mine], alone.v)
    none = hz.ensemble(PENDULUM, q, v, 1.0, parameters={"gamma": gamma}, events=["theta - 50"], **wanted)
    assert none.events[0].q.shape == (0, 1) and none.events[0].member.dtype == int


def test_members_with_fast_phases_vary_their_steps():
    # The thermostat of Nose, whose clock s comes near 0: equal steps fail.
    nose = dict(coordinates=["x", "s"], parameters={"m": 0.1}, accuracy=1e-8)
    text, q = "s^2*x'^2/2 + m*s'^2/2 - x^2/2 - log(s)", np.array([[0.4, 0.8], [1.0, 1.2], [1.6, 0.6]])
    v = np.tile([0.3, 0.0], (3, 1))
    many = hz.ensemble(text, q, v, 20.0, **nose)
    assert many.success.all() and many.own_plans == 3
    for i in range(3):
        assert np.array_equal(many.q[i], hz.solve(text, q[i], v[i], 20.0, **nose).q[-1])
    given = hz.ensemble(text, q, v, 0.1, integrator="gauss_4", step=0.01, coordinates=["x", "s"], parameters={"m": 0.1})
    assert given.own_plans == 0


def test_shapes_are_checked():
    ask = lambda q, v, **more: hz.ensemble(PENDULUM, q, v, 1.0, coordinates=NAMES, **more)
    with pytest.raises(ValueError, match="`q0`"):
        ask([1.0], [0.0], parameters={"gamma": 0.0})
    with pytest.raises(ValueError, match="`v0`"):
        ask(np.ones((3, 1)), np.ones((2, 1)), parameters={"gamma": 0.0})
    with pytest.raises(ValueError, match=r"parameters\[\"gamma\"\]"):
        ask(np.ones((3, 1)), np.ones((3, 1)), parameters={"gamma": np.zeros(4)})
    with pytest.raises(ValueError, match="`z0`"):
        ask(np.ones((3, 1)), np.ones((3, 1)), z0=[0.0], parameters={"gamma": 0.0})


def part(work):
    system, q, v = work
    many = hz.ensemble(system, q, v, 3.0, integrator="gauss_8", step=0.25, threads=1)
    return many.q


def end(sol):
    return sol.q[-1], sol(0.5).q


def test_processes_give_the_same_numbers():
    system = hz.system(PENDULUM, NAMES, {"gamma": -0.1})
    q, v = starts(64)
    whole = part((system, q, v))
    parts = [(system, q[i : i + 16], v[i : i + 16]) for i in range(0, 64, 16)]
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert np.array_equal(np.concatenate(list(pool.map(part, parts))), whole)
        sol = hz.solve(system, [1.0], [0.0], 1.0)
        there, here = pool.submit(end, sol).result(), end(sol)
        assert np.array_equal(there[0], here[0]) and np.array_equal(there[1], here[1])


def test_joblib_gives_the_same_numbers():
    system = hz.system(PENDULUM, NAMES, {"gamma": -0.1})
    q, v = starts(32)
    jobs = (joblib.delayed(part)((system, q[i : i + 16], v[i : i + 16])) for i in (0, 16))
    assert np.array_equal(np.concatenate(joblib.Parallel(n_jobs=2)(jobs)), part((system, q, v)))
