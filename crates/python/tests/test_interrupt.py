"""Ctrl-C ends a long run; other threads go on meanwhile."""

import os
import pickle
import signal
import threading
import time

import herglotz as hz
import numpy as np
import pytest

PENDULUM = "theta'^2/2 + cos(theta) + gamma*z"
# Some minutes.
LONG = dict(integrator="gauss_2", steps=400_000_000, coordinates=["theta"], parameters={"gamma": -1e-9})


@pytest.fixture(autouse=True)
def signals_are_heard():
    """A process that a script has started in the background ignores Ctrl-C, and its Python with it."""
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
        # Some seconds.
        return hz.solve(
            PENDULUM,
            [1.0],
            [0.0],
            np.linspace(0.0, 1e6, 1001),
            integrator="gauss_2",
            steps=20_000_000,
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
