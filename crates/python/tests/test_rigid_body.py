"""Rigid bodies about a fixed point: published numbers, momenta, events and invalid input."""

import herglotz as hz
import numpy as np
import pytest

FREE = (0.328817081371932892, -0.494159614067396359, -0.231714161269102468)
TOP = {
    "inertia": np.diag([0.234375, 0.46875, 0.234375]),
    "mass": 15.0,
    "centre": (0, 1, 0),
    "gravity": (0, 0, -9.81),
    "omega": (0, 150, -4.61538),
}


def test_a_damped_free_body_is_that_in_closed_form():
    times = np.linspace(0, 10, 101)
    sol = hz.rigid_body((1, 2, 3), gamma=-0.1, omega=(1, 1 / 2, 1 / 3), t=times, accuracy=1e-12)
    assert sol.success and sol.error_estimate <= 1e-12
    assert np.array_equal(sol.t, times) and sol.attitude.shape == (101, 4) and sol.energy.shape == (101,)
    # The error is relative to the size of the momentum.
    assert np.abs(sol.Pi[-1] - FREE).max() < 1e-12
    # The momentum in space keeps its direction, and its length decays; 1e4 rounding errors are the most there can be.
    assert np.allclose(sol.M, np.exp(-0.1 * times)[:, None], rtol=1e-13, atol=0)
    assert np.allclose(np.linalg.norm(sol.attitude, axis=1), 1, rtol=1e-15, atol=0)
    assert np.allclose(sol.omega, sol.Pi / [1, 2, 3], rtol=1e-15, atol=0)


def test_the_heavy_top_is_that_of_the_literature():
    way = {"integrator": "sofroniou_spaletta_10", "steps": 60}
    sol = hz.rigid_body(**TOP, t=2.0, events="tip_z + 0.4", **way)
    u = sol.tip[-1] - (0, 1, 0)
    assert np.abs(u - (-0.150416822746, -1.724165591637, -0.673022269560)).max() < 1e-11
    assert len(sol.events) == 1 and len(sol.events[0].t) >= 2
    assert np.abs(sol.events[0].tip[:, 2] + 0.4).max() < 1e-12
    falling = hz.rigid_body(**TOP, t=2.0, events=hz.Event("tip_z + 0.4", "falling", terminal=True), **way)
    assert falling.success and falling.t_end == pytest.approx(sol.events[0].t[0], abs=1e-14)


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ({"attitude": (1, 0.1, 0, 0)}, "`attitude`.*norm 1.00"),
        ({"attitude": (1, 0, 0)}, "`attitude` has the shape"),
        ({"inertia": (1, 1, 3)}, "`inertia`.*triangle inequality"),
        ({"inertia": (1, 1)}, "`inertia` has the shape"),
        ({"inertia": [[1, 0.5, 0], [0.4, 1, 0], [0, 0, 1]]}, "`inertia`.*symmetric"),
        ({"omega": (1, np.nan, 0)}, r"`omega\[1\]` is NaN"),
        ({"omega": None}, "`omega` is not given"),
        ({"integrator": "gauss_2", "step": 0.1, "omega": (0, 150, 0)}, "`step`.*beyond the chart.*at most 2.0"),
        ({"integrator": "midpoint", "step": 0.1}, "`integrator`.*gauss_4"),
        ({"gravity": (0, 0, -9.81)}, "`gravity`.*centre"),
        ({"centre": (0, 0, 1)}, "`mass`"),
        ({"events": "energy - 1"}, "energy"),
        ({"accuracy": 1e-25}, "`accuracy`.*is not reached"),
    ],
)
def test_invalid_arguments_are_refused(change, error):
    with pytest.raises(ValueError, match=error):
        hz.rigid_body(**{"inertia": (1, 2, 2.5), "omega": (1, 1, 1), "t": 1.0} | change)
