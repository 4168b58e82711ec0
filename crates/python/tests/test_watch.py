"""Progress and callbacks during runs, and the states that they reach, for every kind of motion."""

import sys

import herglotz as hz
import numpy as np
import pytest

PENDULUM = dict(coordinates=["theta"], parameters={"gamma": -1e-4})
L = "theta'^2/2 + cos(theta) + gamma*z"
# Each of them takes some tenths of a second, with rows that are far apart.
MANY = {
    "lagrangian": lambda **watch: hz.solve(L, [1.0], [0.0], 2e4, integrator="gauss_2", steps=400_000, **PENDULUM, **watch),
    "hamiltonian": lambda **watch: hz.solve(
        H="p_x^2/2 - cos(x) + z/1000", q0=[1.0], p0=[0.0], t=1e3, coordinates=["x"], integrator="gauss_2", steps=50_000, **watch
    ),
    "constraints": lambda **watch: hz.solve(
        "(x'^2 + y'^2)/2 - y", [0.6, -0.8], [0.8, 0.6], 1e3, constraints="x^2 + y^2 = 1", coordinates=["x", "y"],
        integrator="gauss_2", steps=20_000, **watch,
    ),  # fmt: skip
    "rigid body": lambda **watch: hz.rigid_body((1, 2, 3), omega=(1, 0.5, 0.25), gamma=-1e-3, t=1e3, integrator="strang", steps=200_000, **watch),
    "lattice": lambda **watch: hz.lattice("x'^2/2 + cos(x)", "-(xr - xl)^2/2", np.linspace(0, 1, 50), 0.0, 1e3, step=0.01, **watch),
    "bodies": lambda **watch: hz.bodies([1.0, 1e-3], [[0, 0], [1, 0]], [[0, 0], [0, 1]], 1e3, step=0.01, **watch),
}  # fmt: skip
KINDS = pytest.mark.parametrize("kind", MANY)


@KINDS
def test_a_callback_sees_the_present_state_and_stops_the_run(kind):
    seen = []

    def watch(sol):
        seen.append((sol.t[-1], sol.t_end, sol.steps, sol.success, len(sol.t)))
        return len(seen) == 3

    sol = MANY[kind](callback=watch, callback_interval=0.0)
    times = [t for t, *_ in seen]
    assert len(seen) == 3 and 0.0 <= times[0] < times[1] < times[2]
    # The start, and the present state, which is the end so far.
    assert all((end, steps, success, rows) == (t, None, False, 1 + (t > 0.0)) for t, end, steps, success, rows in seen)
    assert sol.status == f"stopped by `callback` at t = {sol.t_end}" and not sol.success
    assert times[2] <= sol.t_end < MANY[kind]().t_end
    assert float(np.ravel(sol.end.t)[0]) == sol.t_end


def test_a_stopped_run_goes_on_to_the_last_bit():
    whole = MANY["lagrangian"]()
    stopped = MANY["lagrangian"](callback=lambda sol: sol.t_end > 3.0, callback_interval=0.0)
    assert 3.0 < stopped.t_end < whole.t_end
    rest = stopped.resume()
    assert rest.success and (rest.q[-1], rest.v[-1], rest.z[-1]) == (whole.q[-1], whole.v[-1], whole.z[-1])
    assert rest.steps == whole.steps


def test_a_callback_that_returns_nothing_changes_nothing():
    count = 0

    def watch(sol):
        nonlocal count
        count += 1

    sol, plain = MANY["lagrangian"](callback=watch, callback_interval=0.0), MANY["lagrangian"]()
    assert count > 100 and sol.success and sol.q[-1] == plain.q[-1]
    # The interval has not passed.
    count = 0
    MANY["lagrangian"](callback=watch, callback_interval=1e9)
    assert count == 0


@KINDS
def test_an_exception_of_a_callback_is_raised(kind):
    with pytest.raises(ZeroDivisionError):
        MANY[kind](callback=lambda sol: 1 / 0, callback_interval=0.0)


def test_observed_columns_and_events_are_in_the_solution_so_far():
    seen = []

    def watch(sol):
        seen.append((sol["height"][-1] - (1 - np.cos(sol.q[-1, 0])), len(sol.events["bottom"].t), sol.log_factor[-1]))
        return True

    hz.solve(
        L, [1.0], [0.0], np.linspace(0, 2e4, 10_001), integrator="gauss_2", steps=400_000, callback=watch,
        callback_interval=0.02, observe={"height": "1 - cos(theta)"}, events={"bottom": "theta"}, conformal_factor=True, **PENDULUM,
    )  # fmt: skip
    ((height, crossings, factor),) = seen
    assert abs(height) < 1e-15 and crossings > 0 and factor < 0.0


@pytest.fixture
def without_tqdm(monkeypatch):
    monkeypatch.setitem(sys.modules, "tqdm", None)
    monkeypatch.setitem(sys.modules, "tqdm.auto", None)


@KINDS
def test_progress_is_a_line_on_standard_error(kind, without_tqdm, capsys):
    assert MANY[kind](progress=True).success
    shown = capsys.readouterr().err
    assert shown.startswith("\r") and "\r100 % after" in shown and shown.endswith(" s\n")


def test_a_run_that_is_stopped_does_not_show_that_it_is_complete(without_tqdm, capsys):
    MANY["lagrangian"](progress=True, callback=lambda sol: True, callback_interval=0.0)
    assert "100 %" not in capsys.readouterr().err


def test_progress_of_an_ensemble(without_tqdm, capsys):
    found = hz.ensemble(L, np.linspace(0.1, 1, 40)[:, None], np.zeros((40, 1)), 2e3, integrator="gauss_4", steps=20_000, progress=True, **PENDULUM)
    assert found.success.all()
    parts = [float(part.split("%")[0]) for part in capsys.readouterr().err.split("\r")[1:]]
    assert parts == sorted(parts) and parts[-1] == 100.0


def test_progress_is_a_bar_of_tqdm(monkeypatch):
    class Bar:
        made = []

        def __init__(self, total, bar_format):
            self.n, self.seen, self.is_closed = 0, [], False
            Bar.made.append(self)

        def refresh(self):
            self.seen.append(self.n)

        def close(self):
            self.is_closed = True

    class Module:
        tqdm = Bar

    monkeypatch.setitem(sys.modules, "tqdm", Module)
    monkeypatch.setitem(sys.modules, "tqdm.auto", Module)
    MANY["lagrangian"](progress=True)
    with pytest.raises(ZeroDivisionError):
        MANY["lagrangian"](progress=True, callback=lambda sol: 1 / 0, callback_interval=0.0)
    first, second = Bar.made
    assert first.seen[-1] == 100 and first.is_closed and second.is_closed and 100 not in second.seen


def test_the_end_of_a_terminal_event():
    falls = dict(coordinates=["x"], events=hz.Event("x", "falling", terminal=True))
    sol = hz.solve("x'^2/2 - x", [1.0], [0.0], [0.0, 1.0, 5.0], **falls)
    (t,), end = sol.events[0].t, sol.end
    assert len(sol.t) == 2 and end.t == sol.t_end == t
    # x = 1 - t^2/2
    assert abs(t - np.sqrt(2)) < 1e-9 and abs(end.q[0]) < 1e-9 and abs(end.v[0] + np.sqrt(2)) < 1e-9
    assert abs(end.energy - 1.0) < 1e-9 and end.p[0] == end.v[0] and abs(end.z - (t**3 / 3 - t)) < 1e-9
    by_h = hz.solve(H="p_x^2/2 + x", q0=[1.0], p0=[0.0], t=5.0, coordinates=["x"], events=hz.Event("x", "falling", terminal=True))
    assert by_h.end.t == by_h.t_end and abs(by_h.end.t - t) < 1e-9 and abs(by_h.end.energy - 1.0) < 1e-9
    body = hz.rigid_body((1, 2, 3), omega=(1, 0.5, 0.25), t=5.0, events=[hz.Event("t - 2", terminal=True)])
    assert abs(body.end.t[0] - 2.0) < 1e-9
    # Without an event, the last row.
    whole = hz.solve("x'^2/2 - x", [1.0], [0.0], 2.0, coordinates=["x"])
    assert whole.end.q[0] == whole.q[-1, 0] and whole.end.energy == whole.energy[-1]
    lattice = MANY["lattice"]()
    assert np.array_equal(lattice.end.q, lattice.q[-1]) and lattice.end.energy == lattice.energy[-1]
