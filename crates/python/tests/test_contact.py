"""Coordinates that come to rest on the surface of an event and stay there."""

import herglotz as hz
import numpy as np
import pytest

FLOOR = hz.Event("x", "falling", reset={"x'": "-e*x'"}, rest={"x'": "0"})
BALL = dict(L="x'^2/2 - x + k*t*x", coordinates=["x"], parameters={"e": 0.5, "k": 0.0}, events=FLOOR)
LIMIT = 3 * np.sqrt(2)


@pytest.mark.parametrize("way", [dict(accuracy=1e-10), dict(integrator="gauss_4", step=0.05)])
def test_a_ball_lies_on_its_floor(way):
    sol = hz.solve(q0=[1.0], v0=[0.0], t=[0.0, 4.0, 5.0, 30.0], **BALL, **way)
    assert sol.success and sol["contact_x"].tolist() == [0, 0, 1, 1]
    assert sol.q[2:].tolist() == [[0, 1], [0, 1]] and sol.v[2:].tolist() == [[0, 0], [0, 0]]
    assert sol.events[0].t[-1] == pytest.approx(LIMIT, abs=1e-8)
    assert sol(LIMIT + 0.1).q.tolist() == [0, 1] and sol(4.0).q[1] == 0
    assert sol.end.q.tolist() == [0, 1] and abs(sol.end.energy) < 1e-15
    later = sol.resume(40.0)
    assert later.q.tolist() == [[0, 1], [0, 1]]
    names = list(sol.to_pandas().columns)
    assert "contact_x" in names and "x" in names
    assert sol.to_xarray().coordinate.values.tolist() == ["x", "contact_x"]


def test_a_force_pulls_it_off_and_its_derivatives():
    """x = k (t - 1/k)^3/6 from t = 1/k."""
    given = BALL | dict(parameters={"e": 0.5, "k": 0.1})
    sol = hz.solve(q0=[0.0], v0=[0.0], t=[0.0, 9.9, 12.0, 14.0], accuracy=1e-11, **given)
    x = 0.1 * (sol.t[2:] - 10) ** 3 / 6
    assert np.allclose(sol["x"], [0, 0, *x], rtol=0, atol=1e-9) and sol["contact_x"].tolist() == [1, 1, 0, 0]
    found = sol.sensitivity("k")
    t = sol.t[2:]
    assert np.allclose(found.q[:, 0], [0, 0, *((t - 10) ** 3 / 6 + (t - 10) ** 2 / 0.2)], rtol=0, atol=1e-7)
    # Where it starts above the floor, it comes to rest first, and the derivatives in the height are lost.
    gradient = sol.pullback(q=[1.0, 0.0]).parameters["k"]
    assert gradient == pytest.approx(found.q[-1, 0], abs=1e-9)


def test_members_of_an_ensemble():
    heights = np.array([[0.0], [0.3], [1.0], [2.0]])
    many = hz.ensemble(q0=heights, v0=0 * heights, t=[0.0, 2.0, 7.0], accuracy=1e-10, **BALL)
    assert many.success.all() and many.q.shape == (4, 3, 2)
    for i, q0 in enumerate(heights):
        sol = hz.solve(q0=q0, v0=[0.0], t=[0.0, 2.0, 7.0], accuracy=1e-10, **BALL)
        assert np.allclose(many.q[i], sol.q, rtol=0, atol=1e-9) and many.q[i, -1].tolist() == [0, 1]
    assert many["contact_x"][:, -1].tolist() == [1, 1, 1, 1]


def test_what_has_no_contact():
    # A state that is assigned beside, and a function of two coordinates.
    off = hz.Event("x", "falling", reset={"x'": "-x'/2"}, rest={"x'": "1"})
    sol = hz.solve("x'^2/2 - x", [1.0], [0.0], 4.3, coordinates=["x"], events=off, integrator="gauss_4", step=0.1)
    assert sol.success and sol.q.shape[1] == 1 and sol.q[-1, 0] > 0
    slope = hz.Event("y - x/4", "falling", reset={"x'": "0", "y'": "0"}, rest={"x'": "0", "y'": "0"})
    sol = hz.solve(
        "(x'^2 + y'^2)/2 - y", [0.0, 1.0], [0.0, 0.0], 3.0, coordinates=["x", "y"], events=slope, integrator="gauss_4", step=0.1
    )
    assert not sol.success and "is pressed onto it" in sol.status
    with pytest.raises(ValueError, match="no unique past"):
        hz.solve(q0=[1.0], v0=[0.0], t=[0.0, -1.0], **BALL)
    with pytest.raises(ValueError, match="`q0` has 3 numbers, but the system has 1 coordinates"):
        hz.solve(q0=[1.0, 0.0, 0.0], v0=[0.0, 0.0, 0.0], t=1.0, **BALL)


def test_changes_of_the_mode_are_events():
    """A ball without restitution leaves a plate a sin t where a sin t = g, with dt/da = -g/(a sqrt(a^2 - g^2))."""
    plate = hz.Event("x - a*sin(t)", "falling", reset={"x'": "a*cos(t)"}, rest={"x'": "a*cos(t)"})
    events = {"meets": plate, "changes": "contact_x", "leaves": hz.Event("contact_x", "falling")}
    given = dict(coordinates=["x"], parameters={"a": 2.0}, accuracy=1e-11, events=events)
    sol = hz.solve("x'^2/2 - x", [0.0], [2.0], 9.0, **given)
    released = np.arcsin(0.5) + np.array([0, 2 * np.pi])
    assert np.allclose(sol.events["leaves"].t, released, rtol=0, atol=1e-9)
    changes = sol.events["changes"]
    assert isinstance(changes, hz.Crossings) and changes.q[:, 1].tolist() == [0, 1, 0]
    assert changes.t[1] == sol.events["meets"].t[0]
    # Derivatives end where it lands, at the limit of impacts.
    found = hz.solve("x'^2/2 - x", [0.0], [2.0], 5.0, **given).sensitivity("a").event_times
    assert np.allclose(found["leaves"], -1 / (2 * np.sqrt(3)), rtol=0, atol=1e-8) and len(found["meets"]) == 0
    with pytest.raises(ValueError, match="limit of infinitely many resets"):
        sol.sensitivity("a")
    with pytest.raises(ValueError, match="do not end a motion"):
        hz.solve("x'^2/2 - x", [0.0], [2.0], 9.0, **given | dict(events=[plate, hz.Event("contact_x", terminal=True)]))
