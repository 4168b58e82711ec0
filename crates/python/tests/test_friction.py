"""Dry friction that sticks and slips."""

import pickle

import herglotz as hz
import numpy as np
import pytest

BLOCK = dict(L="x'^2/2 - k*x^2/2", q0=[0.0], v0=[0.3], coordinates=["x"], parameters={"k": 1.0})
BELT = {"x": {"sliding": 0.6, "sticking": 1.0, "surface": 0.3}}


def test_a_block_sticks_slips_and_sticks_again():
    t = np.linspace(0.0, 40.0, 801)
    sol = hz.solve(**BLOCK, t=t, friction=BELT)
    mode = sol["slip_x"]
    assert sol.success and set(mode) == {0.0, 1.0} and sol.q.shape == (801, 2)
    assert np.abs(sol["x'"][mode == 0] - 0.3).max() < 1e-14
    # While it slips it swings about x = 0.6 with the amplitude sqrt(0.4^2 + 0.3^2).
    assert np.isclose(sol["x"].max(), 1.1, atol=1e-3)
    # Sticking holds until the spring exceeds the static friction, first at x = u t = 1.
    assert mode[t < 3.33].max() == 0 and mode[(t > 3.34) & (t < 5)].min() == 1


def test_the_times_of_sticking_and_slipping_are_events():
    events = {"changes": "slip_x", "slips": hz.Event("slip_x", "rising"), "sticks": hz.Event("slip_x", "falling")}
    sol = hz.solve(**BLOCK, t=20.0, friction=BELT, events=events, accuracy=1e-11)
    # It sticks until x = u t = 1, and slips for twice the time in which x = 0.6 + 0.4 cos t + 0.3 sin t comes to its largest value
    # less pi: until the velocity is 0.3 again.
    slips = 2 * (np.pi - np.arctan2(0.4, 0.3))
    assert sol.events["slips"].t[0] == pytest.approx(1 / 0.3, abs=1e-9)
    assert sol.events["sticks"].t[0] == pytest.approx(1 / 0.3 + slips, abs=1e-9)
    changes = sol.events["changes"]
    assert changes.q[:, 1].tolist() == ([1, 0] * len(changes.t))[: len(changes.t)]
    # x = fs/k is reached at fs/(k u).
    assert sol.sensitivity("k").event_times["slips"][0] == pytest.approx(-1 / 0.3, abs=1e-8)


@pytest.mark.parametrize(
    "friction",
    [{"x": "mu*9.81"}, {"x": ("coulomb", "mu", 9.81)}, {"x": ("coulomb", 0.3, lambda t, q, v, z: 9.81 + 0 * t)}, {"x": {"sliding": "mu*9.81"}}],
)
def test_a_block_stops_in_all_forms(friction):
    used = "mu" in repr(friction)
    sol = hz.solve("x'^2/2", [0.0], [2.0], 3.0, coordinates=["x"], parameters={"mu": 0.3} if used else None, friction=friction)
    assert np.isclose(sol.q[-1, 0], 4 / (2 * 0.3 * 9.81)) and abs(sol.v[-1, 0]) < 1e-14 and sol["slip_x"][-1] == 0


def test_the_stopping_distance_depends_on_the_friction():
    of = hz.system("x'^2/2", ["x"], {"mu": 0.3}, friction={"x": "mu*9.81"})
    assert hz.system(of, parameters={"mu": 0.4}).friction == of.friction and pickle.loads(pickle.dumps(of)).friction == of.friction
    sol = hz.solve(of, [0.0], [2.0], 3.0, accuracy=1e-10)
    # The distance is v^2/(2 mu g).
    slopes = sol.sensitivity(["mu", "x'"]).q[-1, 0]
    assert np.allclose(slopes, [-4 / (2 * 0.09 * 9.81), 2 * 2 / (2 * 0.3 * 9.81)], rtol=1e-7)


@pytest.mark.parametrize(
    "friction, message",
    [
        (3.0, "it must give friction by coordinate"),
        ({"x": ("viscous", 1.0, 2.0)}, "it must be a formula"),
        ({"x": {"static": 1.0}}, "has the entry 'static'"),
        ({"x": {"sticking": 1.0}}, "has no entry 'sliding'"),
        ({"y": 1.0}, "(?s)the friction on \"y\": .*there is no coordinate `y`"),
        ({"x": {"sliding": 1.0, "surface": "x"}}, "must be a function of time"),
    ],
)
def test_what_is_refused(friction, message):
    with pytest.raises(ValueError, match=message):
        hz.solve(**BLOCK, t=1.0, friction=friction)


def test_backward_in_time_is_refused():
    with pytest.raises(ValueError, match="no unique past"):
        hz.solve(**BLOCK, t=-1.0, friction=BELT)
