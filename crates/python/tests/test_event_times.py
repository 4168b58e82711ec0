"""Derivatives of the times of events, of ends at events, and under constraints; fits to times of events."""

import herglotz as hz
import numpy as np
import pytest

FLOOR = hz.Event("x", "falling", reset={"x'": "-e*x'"})


def ball(e=0.5, g=2.0, t=3.6, **more):
    return hz.solve("x'^2/2 - g*x", [0.0], [2.0], t, coordinates=["x"], parameters={"e": e, "g": g}, events=FLOOR, **more)


def test_times_of_bounces_have_the_derivatives_of_their_formulas():
    # The ball starts with the speed v; its bounces are 2 v/g e^k apart.
    sol = ball()
    found = sol.sensitivity(["e", "g", "x'"])
    (times,) = found.event_times
    assert times.shape == (3, 3) and found.q.shape == (len(sol.t), 1, 3)
    e, g, v = 0.5, 2.0, 2.0
    k = np.arange(3)
    sums = np.cumsum(e**k)
    slopes = np.cumsum(k * e ** np.maximum(k - 1, 0))
    expected = np.stack([2 * v / g * slopes, -2 * v / g**2 * sums, 2 / g * sums], axis=1)
    assert np.allclose(times, expected, rtol=1e-9, atol=1e-9)


def test_events_by_name_without_resets_and_with_parameters():
    events = {"level": "x - c", "turn": hz.Event("x'", "falling")}
    run = lambda c, k: hz.solve(  # noqa: E731
        "x'^2/2 - k*x^2/2 - z/10", [1.0], [0.3], 6.0, coordinates=["x"], parameters={"c": c, "k": k}, events=events, accuracy=1e-11
    )
    found = run(0.2, 1.3).sensitivity(["c", "k"]).event_times
    assert set(found) == {"level", "turn"}
    d = 1e-4
    for j, (after, before) in enumerate([(run(0.2 + d, 1.3), run(0.2 - d, 1.3)), (run(0.2, 1.3 + d), run(0.2, 1.3 - d))]):
        for name in events:
            expected = (after.events[name].t - before.events[name].t) / (2 * d)
            assert np.allclose(found[name][:, j], expected, atol=1e-6)


def test_the_end_at_an_event_moves_with_it():
    ground = hz.Event("y", "falling", terminal=True)
    run = lambda g: hz.solve(  # noqa: E731
        "(x'^2 + y'^2)/2 - g*y - z/20", [0.0, 1.0], [3.0, 2.0], 9.0, coordinates=["x", "y"], parameters={"g": g}, events=ground, accuracy=1e-11
    )
    sol, d = run(9.81), 1e-3
    found = sol.sensitivity("g")
    after, before = run(9.81 + d), run(9.81 - d)
    assert found.event_times[0].shape == (1,)
    assert np.isclose(found.event_times[0][0], (after.t_end - before.t_end) / (2 * d), atol=1e-7)
    for name in ("q", "v", "p", "z"):
        expected = (getattr(after.end, name) - getattr(before.end, name)) / (2 * d)
        assert np.allclose(getattr(found.end, name), expected, atol=1e-6)


def test_a_linkage_in_the_length_of_a_rod():
    text = "(x'^2 + y'^2 + u'^2 + w'^2)/2 - 9.81*(y + w) - z/10"
    rods = ["x^2 + y^2 = l^2", "(u - x)^2 + (w - y)^2 = r^2"]
    run = lambda l, r: hz.solve(  # noqa: E731
        text, [0.9, 0.1, 1.5, -0.4], [0.0] * 4, [0.0, 0.7, 1.5], coordinates=["x", "y", "u", "w"], parameters={"l": l, "r": r},
        constraints=rods, project=True, integrator="gauss_4", steps=60,
    )  # fmt: skip
    found, d = run(1.0, 0.8).sensitivity(["l", "r"]), 1e-4
    for j, (after, before) in enumerate([(run(1 + d, 0.8), run(1 - d, 0.8)), (run(1, 0.8 + d), run(1, 0.8 - d))]):
        for name in ("q", "v", "p"):
            expected = (getattr(after, name) - getattr(before, name)) / (2 * d)
            assert np.allclose(getattr(found, name)[:, :, j], expected, rtol=1e-5, atol=1e-5)
    slopes = run(1.0, 0.8).pullback(q=np.eye(4)[2])
    assert np.isclose(slopes.parameters["l"], found.q[-1, 2, 0], rtol=1e-9)
    loss = hz.value_and_grad("u")
    value, slopes = loss(
        text, [0.9, 0.1, 1.5, -0.4], [0.0] * 4, 1.5, coordinates=["x", "y", "u", "w"], parameters={"l": 1.0, "r": 0.8},
        constraints=rods, project=True, integrator="gauss_4", steps=60,
    )  # fmt: skip
    assert np.isclose(value, run(1.0, 0.8).q[-1, 2]) and np.isclose(slopes.parameters["r"], found.q[-1, 2, 1], rtol=1e-9)


def test_the_mean_of_a_thermostat():
    # Contact density dynamics of an oscillator: the mean of x^2 over the rows, in the coupling beta.
    text = "exp(beta*(p_x^2/2 + 2*x^2)/2)*2*sqrt(c)*cosh(z/(2*c))"
    times = np.linspace(0.0, 4.0, 81)
    run = lambda beta: hz.solve(  # noqa: E731
        H=text, q0=[0.1258], p0=[0.748], z0=-0.9174, t=times, coordinates=["x"], parameters={"beta": beta, "c": 2.0}, integrator="gauss_8", steps=400
    )
    sol, d = run(0.1), 1e-5
    weights = 2 * sol.q / len(times)
    mean = lambda of: (of.q[:, 0] ** 2).mean()  # noqa: E731
    expected = (mean(run(0.1 + d)) - mean(run(0.1 - d))) / (2 * d)
    assert np.isclose(sol.pullback(q=weights).parameters["beta"], expected, rtol=1e-6)
    assert np.isclose((weights * sol.sensitivity("beta").q).sum(), expected, rtol=1e-6)


def test_the_nutation_of_a_heavy_top_in_its_inertia():
    top = lambda i3: hz.rigid_body(  # noqa: E731
        (0.3, 0.46875, i3), mass=15.0, centre=(0.0, 1.0, 0.0), gravity=(0.0, 0.0, -9.81), omega=(0.0, 150.0, -4.61538), t=0.5,
        integrator="gauss_4", steps=400, sensitivity=True,
    )  # fmt: skip
    d = 1e-5
    slopes = top(0.25).derivatives.in_parameters["inertia33"]
    after, before = top(0.25 + d), top(0.25 - d)
    # The first three numbers of a derivative are a rotation in the body: the tip moves by its product with the centre.
    turn = np.cross(slopes[:3], [0.0, 1.0, 0.0])
    expected = (after.tip[-1] - before.tip[-1]) / (2 * d)
    matrix = rotation(top(0.25).attitude[-1])
    assert np.allclose(matrix @ turn, expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())


def rotation(quaternion):
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_a_fit_to_times_of_bounces():
    times = ball(0.8, 9.81, 1.4).events[0].t
    measured = times.copy()
    measured[1] = np.nan
    found = hz.fit(
        "x'^2/2 - g*x", [0.0], [2.0], unknowns=["e", "g"], coordinates=["x"], parameters={"e": 0.7, "g": 9.0}, events={"bounce": (FLOOR, measured)},
        sigma={"bounce": 1e-3},
    )  # fmt: skip
    assert found.success and np.isclose(found["e"], 0.8, atol=1e-7) and np.isclose(found["g"], 9.81, atol=1e-6)
    assert len(found.data["bounce"]) == len(times) - 1 and np.abs(found.residuals["bounce"]).max() < 1e-3


@pytest.mark.parametrize(
    "events, message",
    [
        (3, "it must give pairs by name"),
        ({"bounce": FLOOR}, "it must give pairs by name"),
        ({"bounce": (FLOOR, [2.0, 1.0])}, "must be finite and ascend"),
        ({"bounce": (FLOOR, [np.nan])}, "must be finite and ascend"),
        ({"bounce": (FLOOR, [0.4, 0.45, 0.5, 0.55])}, "start nearer to the fit"),
        ({"x": (FLOOR, [0.4])}, "`events` and `data` have both 'x'"),
    ],
)
def test_times_of_events_that_cannot_be_fitted(events, message):
    given = dict(unknowns=["e"], coordinates=["x"], parameters={"e": 0.7, "g": 9.0}, events=events)
    if isinstance(events, dict) and "x" in events:
        given |= dict(t=[0.0, 0.1], data={"x": [0.0, 0.1]})
    with pytest.raises(ValueError, match=message):
        hz.fit("x'^2/2 - g*x", [0.0], [2.0], **given)
