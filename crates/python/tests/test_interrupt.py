"""Ctrl-C ends a long run; other threads go on meanwhile."""

import os
import pickle
import signal
import threading
import time

import herglotz as hz
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


def test_ctrl_c_ends_an_ensemble():
    import numpy as np

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
