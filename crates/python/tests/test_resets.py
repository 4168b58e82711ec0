"""Resets at events: closed forms, what is recorded, dense evaluation, ensembles, continued runs, and errors."""

import pickle

import herglotz as hz
import numpy as np
import pytest

# An elastic ball: L = v^2/2 - q + gamma z from the height 1 at rest, two bounces until T = 5.
Q, V, T = 0.68723929167372442, 0.20210194335121757, 5.0


def ball(t, q, v, z):
    return v @ v / 2 - q[0] - 0.1 * z


def elastic(t, q, v, z):
    return q, -v


FLOOR = hz.Event(lambda t, q, v, z: q[0], "falling", reset=elastic)
TEXT = dict(L="x'^2/2 - x + gamma*z", coordinates=["x"], parameters={"gamma": -0.1})
WAYS = {
    "a function": dict(L=ball, events=FLOOR),
    "a function with z": dict(L=ball, events=hz.Event("q[0]", reset=lambda t, q, v, z: (q, -v, z))),
    "a text": dict(TEXT, events=hz.Event("x", "falling", reset={"x'": "-x'"})),
    "an array of coordinates": dict(L=ball, events=hz.Event("q[0]", reset={"v[0]": "-v[0]"})),
    "a function for a text": dict(TEXT, events={"floor": hz.Event("x", reset={"x'": lambda t, q, v, z: -v[0]})}),
}


def rate(t):
    """The position and the velocity at t by the closed form of the flights: q'' = -1 - 0.1 q'."""
    g = 0.1

    def flight(q, v, s):
        decay = -np.expm1(-g * s) / g
        return q + (v + 1 / g) * decay - s / g, v * np.exp(-g * s) - decay

    q, v, now = 1.0, 0.0, 0.0
    while True:
        # The next impact by Newton's method from a late time.
        s = 10.0
        for _ in range(60):
            s -= flight(q, v, s)[0] / flight(q, v, s)[1]
        if now + s >= t:
            return flight(q, v, t - now)
        q, v, now = 0.0, -flight(q, v, s)[1], now + s


@pytest.mark.parametrize("way", WAYS)
def test_an_elastic_ball(way):
    assert rate(T) == pytest.approx((Q, V), abs=1e-13)
    sol = hz.solve(**WAYS[way], q0=[1.0], v0=[0.0], t=T, accuracy=1e-13)
    assert sol.success, sol.status
    assert abs(sol.q[-1, 0] - Q) < 1e-12 and abs(sol.v[-1, 0] - V) < 1e-12
    (bounces,) = sol.events.values() if isinstance(sol.events, dict) else sol.events
    assert isinstance(bounces, hz.Resets) and bounces.t.shape == (2,) and bounces.after_v.shape == (2, 1)
    assert np.all(bounces.v < 0) and np.array_equal(bounces.after_v, -bounces.v)
    assert np.array_equal(bounces.after_p, -bounces.p) and np.array_equal(bounces.after_z, bounces.z)
    assert np.allclose(bounces.q, 0, atol=1e-14) and np.array_equal(bounces.after_q, bounces.q)


@pytest.mark.parametrize("given", [dict(accuracy=1e-13), dict(integrator="gauss_8", step=0.25)])
def test_dense_evaluation_and_rows_across_resets(given):
    t = np.linspace(0, T, 101)
    sol = hz.solve(ball, [1.0], [0.0], t, events=FLOOR, **given)
    wanted = np.array([rate(x) for x in t])
    assert np.allclose(sol.q[:, 0], wanted[:, 0], rtol=0, atol=1e-12)
    assert np.allclose(sol.v[:, 0], wanted[:, 1], rtol=0, atol=1e-12)
    # At other times, and close to the impacts.
    (bounces,) = sol.events
    near = np.concatenate([np.linspace(0.01, 4.99, 57), *(bounces.t + d for d in (-1e-3, -1e-9, 1e-9, 1e-3))])
    dense, wanted = sol(near), np.array([rate(x) for x in near])
    assert np.allclose(dense.q[:, 0], wanted[:, 0], rtol=0, atol=1e-12)
    assert np.allclose(dense.v[:, 0], wanted[:, 1], rtol=0, atol=1e-12)
    # At the time of a reset the state is that before it.
    assert np.allclose(sol(bounces.t).v, bounces.v, rtol=0, atol=1e-12)
    again = pickle.loads(pickle.dumps(sol))
    assert np.array_equal(again(near).q, dense.q)


def test_backward_in_time_and_continued():
    sol = hz.solve(ball, [1.0], [0.0], 2.0, events=FLOOR, accuracy=1e-13)
    assert len(sol.events[0].t) == 1
    rest = sol.resume(T)
    assert abs(rest.q[-1, 0] - Q) < 1e-12 and len(rest.events[0].t) == 1 and rest.events[0].t[0] > 2
    event = hz.Event(lambda t, q, v, z: q[0], reset=elastic)
    back = hz.solve(ball, rest.q[-1], rest.v[-1], [T, 0.0], z0=rest.z[-1], events=event, accuracy=1e-13)
    assert abs(back.q[-1, 0] - 1.0) < 1e-11 and len(back.events[0].t) == 2 and np.all(np.diff(back.events[0].t) < 0)


def test_other_events_and_columns_beside_resets():
    events = {"floor": FLOOR, "top": hz.Event("v[0]", "falling"), "passes": "q[0] - 0.5"}
    sol = hz.solve(ball, [1.0], [0.0], T, events=events, observe={"e": "energy"}, accuracy=1e-12)
    assert list(sol.events) == list(events) and isinstance(sol.events["top"], hz.Crossings)
    assert len(sol.events["floor"].t) == 2 and len(sol.events["passes"].t) == 4 and sol.momenta == {}
    # The velocity jumps from falling to rising at the floor, which is no passage of the top.
    assert np.all(np.abs(sol.events["top"].v) < 1e-11) and np.all(sol.events["top"].q > 0.5)
    ended = hz.solve(ball, [1.0], [0.0], T, events=[FLOOR, hz.Event("q[0] - 0.5", "rising", True)], accuracy=1e-12)
    assert ended.success and len(ended.events[0].t) == 1 and abs(ended.events[1].q[-1, 0] - 0.5) < 1e-12
    assert ended.events[1].t[-1] == ended.t_end > ended.events[0].t[0]


def test_a_ball_that_loses_speed():
    """e = 0.5 from the height 1 with g = 1: the impacts accumulate at 3 sqrt(2)."""
    floor = hz.Event("x", "falling", reset={"x'": "-e*x'"})
    given = dict(L="x'^2/2 - x", q0=[1.0], v0=[0.0], coordinates=["x"], parameters={"e": 0.5}, events=floor)
    sol = hz.solve(**given, t=4.0, accuracy=1e-12)
    times = np.sqrt(2) * (1 + 2 * np.cumsum([0.0, *(0.5 ** np.arange(1, 30))]))
    assert np.allclose(sol.events[0].t, times[times < 4], rtol=0, atol=1e-12)
    end = hz.solve(**given, t=5.0, integrator="gauss_4", step=0.1)
    assert not end.success and "resets accumulate at t = 4.24264068711928" in end.status
    assert "end the run before it" in end.status
    assert end.t_end < 3 * np.sqrt(2) and len(end.events[0].t) > 4
    with pytest.raises(ValueError, match="resets accumulate at t = 4.2426406871192"):
        hz.solve(**given, t=5.0, accuracy=1e-3)


def test_a_ball_that_comes_to_rest():
    # The coordinate m has no force: m = 0 in flight, m = 1 at rest.
    floor = hz.Event("x", "falling", reset={"x'": "-x'/2"}, rest={"x": "0", "x'": "0", "m": "1"})
    given = dict(coordinates=["x", "m"], force={"x": "-(1 - m)"}, events=floor)
    sol = hz.solve("(x'^2 + m'^2)/2", [1.0, 0.0], [0.0, 0.0], [0.0, 4.0, 6.0], integrator="gauss_4", step=0.1, **given)
    assert sol.status == "completed" and sol.q[-1].tolist() == [0.0, 1.0] and sol.v[-1].tolist() == [0.0, 0.0]
    assert sol.events[0].t[-1] == pytest.approx(3 * np.sqrt(2), abs=1e-9)
    assert sol(5.0).q.tolist() == [0.0, 1.0] and abs(sol(4.0).q[0] - sol.q[1, 0]) < 1e-13


LAWS = {"elastic": 1.0, ("restitution", 0.8): 0.8, ("conformal", 0.64): 0.8, ("restitution", 1): 1.0}


@pytest.mark.parametrize("law", LAWS)
def test_impact_laws(law):
    e, fall = LAWS[law], np.sqrt(2)
    given = dict(q0=[1.0], v0=[0.0], t=3.0, accuracy=1e-12, conformal_factor=True)
    sol = hz.solve("x'^2/2 - x", coordinates=["x"], events=hz.Event("x", impact=law), **given)
    (bounce,) = sol.events
    assert np.allclose(bounce.after_v, -e * bounce.v, rtol=0, atol=1e-13) and abs(bounce.t[0] - fall) < 1e-13
    s = 3.0 - fall
    assert abs(sol.q[-1, 0] - (e * fall * s - s**2 / 2)) < 1e-12
    if isinstance(law, tuple) and law[0] == "conformal":
        assert sol.log_factor[-1] == pytest.approx(np.log(0.64), abs=1e-13)
    by_function = hz.solve(lambda t, q, v, z: v @ v / 2 - q[0], events=hz.Event(lambda t, q, v, z: q[0], impact=law), **given)
    assert abs(by_function.q[-1, 0] - sol.q[-1, 0]) < 1e-12


def test_an_elastic_impact_is_the_elastic_reset():
    sol = hz.solve(ball, [1.0], [0.0], T, events=hz.Event(lambda t, q, v, z: q[0], impact="elastic"), accuracy=1e-13)
    assert abs(sol.q[-1, 0] - Q) < 1e-12 and abs(sol.v[-1, 0] - V) < 1e-12 and len(sol.events[0].t) == 2


def test_an_impact_on_a_slope():
    slope = hz.Event("y - x", impact="elastic")
    sol = hz.solve("(x'^2 + y'^2)/2", [0.0, 1.0], [0.0, -1.0], 2.0, coordinates=["x", "y"], events=slope)
    assert np.allclose(sol.v[-1], [-1.0, 0.0], atol=1e-12) and np.allclose(sol.q[-1], [-1.0, 0.0], atol=1e-9)


def test_what_is_lost_at_a_reset():
    given = dict(L="x'^2/2 - x", q0=[1.0], v0=[0.0], t=2.0, coordinates=["x"], integrator="gauss_4", step=0.5)
    assert not hz.check(**given, events=hz.Event("x", impact="elastic")).losses
    found = hz.check(**given, events=hz.Event("x", impact=("restitution", 0.5)))
    assert not found and "preserves no contact form" in str(found)


def test_a_kick_at_a_time_and_a_change_of_position_and_action():
    kick = hz.Event(lambda t, q, v, z: t - 1.0, reset=lambda t, q, v, z: (q + 2.0, v + 3.0, z + t))
    sol = hz.solve("x'^2/2", [0.0], [1.0], 2.0, coordinates=["x"], events=kick, accuracy=1e-12)
    assert abs(sol.q[-1, 0] - 7.0) < 1e-12 and abs(sol.v[-1, 0] - 4.0) < 1e-12 and abs(sol.z[-1] - 9.5) < 1e-12
    (found,) = sol.events
    assert found.t == pytest.approx([1.0], abs=1e-14) and found.after_z[0] - found.z[0] == pytest.approx(1.0, abs=1e-13)


def test_members_of_ensembles_have_their_own_resets():
    heights, e = np.array([[1.0], [2.0], [0.5]]), np.array([1.0, 0.8, 0.9])
    floor = hz.Event("x", "falling", reset={"x'": "-e*x'"})
    given = dict(L="x'^2/2 - x", coordinates=["x"], events=floor, accuracy=1e-12)
    many = hz.ensemble(q0=heights, v0=np.zeros((3, 1)), t=4.0, parameters={"e": e}, **given)
    assert many.success.all() and isinstance(many.events[0], hz.MemberResets)
    for i in range(3):
        one = hz.solve(q0=heights[i], v0=[0.0], t=4.0, parameters={"e": e[i]}, **given)
        mine = many.events[0].member == i
        assert np.allclose(many.q[i], one.q[-1], atol=1e-10) and np.sum(mine) == len(one.events[0].t)
        assert np.allclose(many.events[0].after_v[mine], -e[i] * many.events[0].v[mine], rtol=1e-14)
    given = {name: value for name, value in given.items() if name != "accuracy"} | dict(integrator="gauss_4", step=0.1)
    stuck = hz.ensemble(q0=heights, v0=np.zeros((3, 1)), t=20.0, parameters={"e": 0.5}, **given)
    assert not stuck.success.any() and "accumulate at t = " in stuck.troubles[0]


def test_a_reset_with_a_force_and_a_table():
    lift = hz.table([0.0, 10.0], [0.5, 0.5])
    sol = hz.solve(
        "x'^2/2 - x",
        [1.0],
        [0.0],
        4.0,
        coordinates=["x"],
        force=lambda t, q, v, z: lift(t),
        events=hz.Event("x", reset=lambda t, q, v, z: (q, -2 * lift(t) * v)),
        accuracy=1e-12,
    )
    # The acceleration is -1/2: the impact is at t = 2 with the speed 1, and the ball is at its top again at t = 4.
    assert sol.events[0].t == pytest.approx([2.0], abs=1e-12)
    assert abs(sol.q[-1, 0] - 1.0) < 1e-11 and abs(sol.v[-1, 0]) < 1e-11


def test_the_representation_of_an_event():
    assert repr(hz.Event("x", reset={"x'": "-x'"})) == "Event('x', 'both', terminal=False, reset={\"x'\": \"-x'\"})"
    assert repr(hz.Event("x")) == "Event('x', 'both', terminal=False)"


BALL = dict(L="x'^2/2 - x", q0=[1.0], v0=[0.0], t=5.0, coordinates=["x"])


def at_floor(reset, **more):
    return BALL | dict(events=hz.Event("x", "falling", reset=reset, **more))


WRONG = {
    "a text": (at_floor("-x'"), r"the reset of an event is \"-x'\"; it must be a function"),
    "an unknown variable": (at_floor({"y": "0"}), "the reset of the event \"x\".*y"),
    "a wrong formula": (at_floor({"x'": "-e*x'"}), "the reset of the event \"x\".*unknown name `e`"),
    "nothing": (at_floor({}), "assigns nothing"),
    "no change": (at_floor(lambda t, q, v, z: (q, v)), "assigns nothing"),
    "a single value": (at_floor(lambda t, q, v, z: -v), r"it must return a tuple \(q, v\) or \(q, v, z\)"),
    "too many": (at_floor(lambda t, q, v, z: (q, v, z, t)), r"it must return a tuple \(q, v\)"),
    "a wrong length": (at_floor(lambda t, q, v, z: (q, [1.0, 2.0])), r"an array of shape \(2,\) as v, but there are 1"),
    "no value": (at_floor(lambda t, q, v, z, e: (q, -e * v)), "the parameter 'e' of <lambda> has no value"),
    "a list as a value": (at_floor({"x'": [1.0]}), r"`reset\[\"x'\"\]` is \[1.0\]"),
    "a terminal event": (at_floor({"x'": "-x'"}, terminal=True), "'x' is terminal and has a reset"),
    "a reset and an impact": (at_floor({"x'": "-x'"}, impact="elastic"), "'x' has a reset and an impact"),
    "a rest alone": (at_floor(None, rest={"x'": "0"}), "'x' has a state of rest without a reset or an impact"),
    "a wrong rest": (at_floor({"x'": "-x'"}, rest={"y": "0"}), "the reset of the event \"x\".*y"),
    "an unknown law": (at_floor(None, impact="plastic"), 'the impact "plastic" of the event "x" must be "elastic"'),
    "a law without its number": (at_floor(None, impact="restitution"), 'the impact "restitution".* needs a number'),
    "a number of a law without one": (at_floor(None, impact=("elastic", 0.5)), 'the impact "elastic" of the event "x" takes no number'),
    "a number as a law": (at_floor(None, impact=0.8), r"the impact 0.8 of the event 'x' must be"),
    "too large a restitution": (at_floor(None, impact=("restitution", 1.5)), "a restitution outside of 0 to 1"),
    "too large a factor": (at_floor(None, impact=("conformal", 2.0)), "a conformal factor that is not positive and at"),
    "a text as a number": (at_floor(None, impact=("restitution", "a")), "the restitution of the event .* finite number"),
    "an impact that rises": (BALL | dict(events=hz.Event("x", "rising", impact="elastic")), "change the sign"),
    "a surface of velocities": (BALL | dict(events=hz.Event("x'", impact="elastic")), "a function of velocities or z"),
    "a constant": (BALL | dict(events=hz.Event("1", reset={"x'": "-x'"})), "has a constant in place of a function"),
    "a direction of SciPy": (
        BALL | dict(events=hz.Event("x", -1, reset={"x'": "-x'"})),
        'the direction -1 of the event "x".*write "falling"',
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_resets(case):
    request, message = WRONG[case]
    with pytest.raises(ValueError, match=message):
        hz.solve(**request)


def test_a_state_beyond_the_surface_ends_the_run():
    sol = hz.solve(**at_floor({"x": "-1"}), integrator="gauss_4", step=0.1)
    assert not sol.success and "leaves the state on the other side of its own surface" in sol.status
