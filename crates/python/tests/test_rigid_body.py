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


DIFFERENCE = 1e-5


def turned(attitude, by):
    """The attitude R exp(by)."""
    angle = np.linalg.norm(by)
    w, u = np.cos(angle / 2), np.asarray(by) * (0.5 * np.sinc(angle / (2 * np.pi)))
    a, b = attitude[0], np.asarray(attitude[1:])
    return np.concatenate([[a * w - b @ u], a * u + w * b + np.cross(b, u)])


def apart(sol, end):
    """The coordinates (turn, Pi, z) of an end, from another one that is near."""
    a, b = sol.end.attitude[0] * [1, -1, -1, -1], end.end.attitude[0]
    turn = 2 * (a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:]))
    return np.concatenate([turn, end.end.Pi[0] - sol.end.Pi[0], end.end.z - sol.end.z])


def test_derivatives_are_those_of_differences():
    top = {
        "inertia": np.array([[1.0, 0.1, 0], [0.1, 1.5, 0.2], [0, 0.2, 2.0]]),
        "mass": 1.2,
        "centre": np.array([0.1, -0.2, 0.3]),
        "gravity": np.array([0.3, 0.0, -2.0]),
        "gamma": -0.2,
        "attitude": np.array([0.6, 0.0, 0.8, 0.0]),
        "omega": np.array([0.5, -0.4, 1.0]),
        "z0": 0.3,
        "torque": ("-0.1*omega1", "0.2*cos(t)*q_x", "0.05*z"),
    }

    def run(sensitivity=False, **changed):
        sol = hz.rigid_body(**{**top, **changed}, t=2.0, integrator="gauss_4", steps=40, sensitivity=sensitivity)
        assert sol.success
        return sol

    sol = run(sensitivity=True)
    found = sol.derivatives
    # A torque acts: the motion is not contact.
    assert found.contact_defect > 1e-3 and found.log_factor == pytest.approx(-0.4, abs=1e-14)
    axes = np.eye(3)

    def difference(change):
        ahead, behind = (apart(sol, run(**change(d))) for d in (DIFFERENCE, -DIFFERENCE))
        return (ahead - behind) / (2 * DIFFERENCE)

    # The error of differences is the square of their step times third derivatives, and round-off over the step.
    near = {"rtol": 1e-7, "atol": 1e-8}
    for k in range(3):
        assert np.allclose(found.in_omega[:, k], difference(lambda d: {"omega": top["omega"] + d * axes[k]}), **near)
        of_turn = difference(lambda d: {"attitude": turned(top["attitude"], d * axes[k])})
        assert np.allclose(found.in_attitude[:, k], of_turn, **near)
        for name in ("centre", "gravity"):
            of = difference(lambda d: {name: top[name] + d * axes[k]})
            assert np.allclose(found.in_parameters[f"{name}{k + 1}"], of, **near)
        for j in range(k, 3):
            entry = np.zeros((3, 3))
            entry[j, k] = entry[k, j] = 1
            of = difference(lambda d: {"inertia": top["inertia"] + d * entry})
            assert np.allclose(found.in_parameters[f"inertia{k + 1}{j + 1}"], of, **near)
    for name in ("mass", "gamma"):
        assert np.allclose(found.in_parameters[name], difference(lambda d: {name: top[name] + d}), **near)
    assert np.allclose(found.in_z, difference(lambda d: {"z0": top["z0"] + d}), **near)
    free = hz.rigid_body((1, 2, 3), gamma=-0.1, omega=(1, 1 / 2, 1 / 3), t=5.0, sensitivity=True)
    assert free.integrator == "gauss_4" and free.derivatives.contact_defect < 1e-12
    with pytest.raises(ValueError, match="`integrator`.*Gauss method"):
        hz.rigid_body((1, 2, 3), omega=(1, 0, 0), t=1.0, integrator="suzuki_4", steps=10, sensitivity=True)


def test_a_torque_brakes_a_body():
    # About a principal axis, J omega' = -c omega + gamma J omega.
    sol = hz.rigid_body((1, 2, 3), gamma=-0.1, torque=(0, 0, "-0.6*omega3"), omega=(0, 0, 2), t=[0, 1, 3], accuracy=1e-11)
    assert sol.integrator == "gauss_5"
    assert np.allclose(sol.omega[:, 2], 2 * np.exp(-0.3 * sol.t), rtol=1e-10, atol=0)
    for torque, error in [
        (("1", "0"), "`torque`.*three texts"),
        (("1", "0", "x"), "x"),
        (("energy", "0", "0"), "`torque`.*`energy`"),
    ]:
        with pytest.raises(ValueError, match=error):
            hz.rigid_body((1, 2, 3), torque=torque, omega=(0, 0, 2), t=1.0)
    with pytest.raises(ValueError, match="`integrator`.*takes no torque"):
        hz.rigid_body((1, 2, 3), torque=("1", "0", "0"), omega=(0, 0, 2), t=1.0, integrator="suzuki_4", steps=10)


def test_a_motion_between_two_attitudes_is_found():
    top = {"mass": 1.0, "centre": (0.1, 0.0, 0.2), "gravity": (0, 0, -1.0), "gamma": -0.1}
    to = np.array([0.6, 0.0, 0.8, 0.0])
    sol = hz.rigid_body_between((1.0, 2.0, 2.5), **top, to=to, omega=(0, 0.9, 0), t=np.linspace(0, 2, 5))
    assert sol.success and np.abs(sol.attitude[-1] - to).max() < 1e-12
    again = hz.rigid_body((1.0, 2.0, 2.5), **top, omega=sol.omega[0], t=2.0, accuracy=1e-11)
    assert np.abs(np.abs(again.attitude[-1]) - to).max() < 1e-10
    with pytest.raises(ValueError, match="`to`.*norm"):
        hz.rigid_body_between((1, 2, 2.5), to=(1, 1, 0, 0), omega=(0, 0.9, 0), t=2.0)
    with pytest.raises(ValueError, match="`to` is not given"):
        hz.rigid_body_between((1, 2, 2.5), omega=(0, 0.9, 0), t=2.0)


def test_many_bodies_are_single_bodies():
    rates, omega = [0.0, -0.1, -0.2], np.array([[1, 0.5, 0.25], [0.3, 1, 0], [0, 0.1, 2]])
    many = [hz.rigid_bodies((1, 2, 3), gamma=rates, omega=omega, t=[0, 1, 4], threads=threads) for threads in (1, 2)]
    for k, (one, two) in enumerate(zip(*many, strict=True)):
        alone = hz.rigid_body((1, 2, 3), gamma=rates[k], omega=omega[k], t=[0, 1, 4])
        assert np.array_equal(one.Pi, two.Pi) and np.array_equal(one.attitude, alone.attitude)
    with pytest.raises(ValueError, match="numbers of bodies differ"):
        hz.rigid_bodies((1, 2, 3), gamma=rates, omega=omega[:2], t=1.0)
    with pytest.raises(ValueError, match="member 1.*norm"):
        hz.rigid_bodies((1, 2, 3), attitude=[[1, 0, 0, 0], [1, 1, 0, 0]], omega=(1, 0, 0), t=1.0)
