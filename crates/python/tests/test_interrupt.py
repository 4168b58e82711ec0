"""Ctrl-C ends a long run, and other threads continue during a run."""

import os
import pickle
import signal
import threading
import time

import herglotz as hz
import numpy as np
import pytest

PENDULUM = "theta'^2/2 + cos(theta) + gamma*z"
# The run would take some minutes.
LONG = dict(integrator="gauss_2", steps=400_000_000, coordinates=["theta"], parameters={"gamma": -1e-9})


@pytest.fixture(autouse=True)
def signals_are_heard():
    """A background process of a script inherits an ignored SIGINT; this restores Python's handler."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def press(after):
    threading.Timer(after, os.kill, (os.getpid(), signal.SIGINT)).start()


def test_ctrl_c_ends_a_run_and_keeps_what_was_computed():
    press(0.4)
    begin = time.monotonic()
    with pytest.raises(hz.Interrupted) as caught:
        hz.solve(PENDULUM, [1.0], [0.0], 1e7, every=1_000_000, **LONG)
    assert time.monotonic() - begin < 5
    assert isinstance(caught.value, KeyboardInterrupt)
    sol = caught.value.solution
    assert not sol.success and 0 < sol.t_end < 1e7 and len(sol.t) >= 1
    again = pickle.loads(pickle.dumps(caught.value)).solution
    assert again.resume(again.t_end + 0.1).success


def test_an_interrupted_run_goes_on_to_the_last_bit():
    def asked():
        # About ten seconds.
        return hz.solve(
            PENDULUM,
            [1.0],
            [0.0],
            np.linspace(0.0, 1.5e5, 1001),
            integrator="gauss_2",
            steps=3_000_000,
            coordinates=["theta"],
            parameters={"gamma": -1e-7},
            events={"bottom": hz.Event("theta", direction="rising")},
            observe={"scaled": "exp(1e-7*t)*theta"},
            conformal_factor=True,
        )

    whole = asked()
    press(0.5)
    with pytest.raises(hz.Interrupted) as caught:
        asked()
    first = pickle.loads(pickle.dumps(caught.value)).solution
    rest = first.resume()
    assert 1 <= len(first.t) < len(whole.t) and rest.success and rest.t_end == whole.t_end
    for name in ("t", "q", "v", "p", "z", "energy", "log_factor"):
        parts = [getattr(first, name), getattr(rest, name)]
        assert np.array_equal(np.concatenate(parts), getattr(whole, name)), name
    assert np.array_equal(np.concatenate([first["scaled"], rest["scaled"]]), whole["scaled"])
    crossed = [first.events["bottom"].t, rest.events["bottom"].t]
    assert len(crossed[1]) > 0 and np.array_equal(np.concatenate(crossed), whole.events["bottom"].t)


def test_ctrl_c_ends_an_ensemble():
    press(0.4)
    begin = time.monotonic()
    many = np.ones((200_000, 1))
    with pytest.raises(KeyboardInterrupt):
        hz.ensemble(
            PENDULUM,
            many,
            many,
            1e2,
            integrator="gauss_2",
            step=0.1,
            coordinates=["theta"],
            parameters={"gamma": -1e-3 * np.ones(200_000)},
        )
    assert time.monotonic() - begin < 20


def test_other_threads_run_meanwhile():
    ticks = []
    done = threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.01)

    thread = threading.Thread(target=tick)
    thread.start()
    press(0.5)
    with pytest.raises(KeyboardInterrupt):
        hz.solve(PENDULUM, [1.0], [0.0], 1e7, **LONG)
    done.set()
    thread.join()
    assert len(ticks) > 10


def heard_within(seconds, asked, error=KeyboardInterrupt, after=0.4):
    """The exception that Ctrl-C raises in a long computation; it must come within this number of seconds."""
    press(after)
    begin = time.monotonic()
    with pytest.raises(error) as caught:
        asked()
    assert time.monotonic() - begin < seconds
    return caught.value


# The trial runs take about twenty seconds and do not reach the accuracy.
COSTLY = dict(
    L="sum(i, 0, 4, q'[i]^2*(1/2 - q[i]^2/10) - q[i]^2/2 - q[i]^4/10)",
    q0=np.linspace(0.5, 1.0, 5),
    v0=np.zeros(5),
    t=200_000.0,
    accuracy=1e-9,
    coordinates=["q[5]"],
)
WEAK = dict(coordinates=["theta"], parameters={"gamma": -1e-9})


def test_ctrl_c_is_heard_in_trial_runs():
    caught = heard_within(2.0, lambda: hz.solve(**COSTLY), hz.Interrupted)
    sol = caught.solution
    assert not sol.success and sol.t_end == 0.0 and sol.steps == 0 and len(sol.t) == 0
    # The requested motion starts again from the beginning.
    rest = heard_within(2.0, sol.resume, hz.Interrupted)
    assert rest.solution.t_end == 0.0


def test_ctrl_c_is_heard_in_a_plan():
    kept = hz.solve(**COSTLY | dict(t=1.0))
    kept._request = (kept._request[0], COSTLY["t"], *kept._request[2:])
    kept._plan = None
    heard_within(2.0, lambda: kept.plan)


def test_ctrl_c_is_heard_in_a_check():
    heard_within(2.0, lambda: hz.check(**COSTLY))
    heard_within(2.0, lambda: hz.check(PENDULUM, [1.0], [0.0], 1e6, integrator="gauss_2", steps=100_000_000, **WEAK))


def test_ctrl_c_is_heard_in_the_trial_runs_of_a_comparison():
    # About eight seconds.
    asked = {name: x for name, x in COSTLY.items() if name != "accuracy"} | dict(t=2000.0)
    heard_within(2.0, lambda: hz.compare(**asked))


def test_ctrl_c_is_heard_in_an_estimate():
    """The run with steps of half the length takes twice as long as the run before it."""
    asked = dict(integrator="gauss_2", steps=5_000_000, **WEAK)
    begin = time.monotonic()
    hz.solve(PENDULUM, [1.0], [0.0], 5e4, **asked)
    first = time.monotonic() - begin
    # In the middle of the estimate, which is from 1 to 3, so that other work on the machine may slow it down.
    after = 2.0 * first
    caught = heard_within(
        after + 0.5 * first, lambda: hz.solve(PENDULUM, [1.0], [0.0], 5e4, estimate=True, **asked), hz.Interrupted, after
    )
    assert caught.solution.t_end == 5e4 and caught.solution.error_estimate == np.inf


def test_ctrl_c_is_heard_in_dense_output():
    sol = hz.solve(PENDULUM, [1.0], [0.0], 1e3, integrator="gauss_2", steps=20_000, **WEAK)
    sol(1.0)
    # About ten seconds.
    many = np.linspace(0.0, 1e3, 2_000_000)
    heard_within(2.0, lambda: sol(many))


def test_ctrl_c_is_heard_in_the_exponential():
    # About ten seconds: eight coordinates, each with the derivatives with respect to all others.
    pendula = "sum(i, 0, 7, q'[i]^2/2 + cos(q[i])) + gamma*z"
    asked = dict(coordinates=["q[8]"], parameters={"gamma": -1e-9})
    heard_within(1.5, lambda: hz.exponential(pendula, 1e5, np.ones(8), np.zeros(8), **asked))


@pytest.mark.parametrize("events", [(), "theta"], ids=["plain", "events"])
@pytest.mark.parametrize("integrator", ["gauss_2", "strang", "midpoint"])
def test_ctrl_c_is_heard_in_an_ensemble_of_long_members(integrator, events):
    """The members that ended before the interruption are kept."""
    count = 40
    ends = np.full((count, 1), 1.0)
    # The first members end at a terminal event after very few steps.
    stop = [hz.Event("theta - 3", terminal=True)]
    q = ends.copy()
    v = ends.copy()
    v[:8] = 50.0
    asked = dict(integrator=integrator, step=1e-3, coordinates=["theta"], parameters={"gamma": -1e-9}, threads=2)
    if events:
        asked["events"] = stop
    caught = heard_within(4.0, lambda: hz.ensemble(PENDULUM, q, v, 1e6, **asked), hz.Interrupted)
    found = caught.solution
    assert len(found) == count and not found.success[-1] and np.isnan(found.t[-1]) | (found.t[-1] < 1e6)
    assert all("interrupted" in found.troubles[i] for i in range(count) if not found.success[i])
    if events:
        assert found.success[:8].all() and np.allclose(found.q[:8], 3.0) and not found.success[8:].any()


def test_the_finished_members_are_kept():
    count = 30_000
    many = np.linspace(0.5, 1.5, count).reshape(-1, 1)
    asked = dict(integrator="gauss_2", step=1e-2, coordinates=["theta"], parameters={"gamma": -1e-3 * np.ones(count)})
    caught = heard_within(5.0, lambda: hz.ensemble(PENDULUM, many, many, 1e2, **asked), hz.Interrupted, after=3.0)
    found = pickle.loads(pickle.dumps(caught)).solution
    done = int(np.sum(found.success))
    assert 0 < done < count and found.success[0]
    # Finished members are bitwise those of an ensemble of their own.
    first = hz.ensemble(PENDULUM, many[:1], many[:1], 1e2, **asked | dict(parameters={"gamma": [-1e-3]}))
    assert found.q[0] == first.q[0] and np.isnan(found.q[~found.success & np.isnan(found.t)]).all()
