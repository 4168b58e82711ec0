"""Geometry, contact maps, checks."""

import herglotz as hz
import numpy as np
import pytest

GAMMA = -0.1


def L(t, q, v, z):
    return v @ v / 2 + np.cos(q[0]) + GAMMA * z


def rates(q, p, z):
    """The right-hand side of Herglotz' equation of L in (q, p, z)."""
    return p, -np.sin(q) + GAMMA * p, p @ p / 2 + np.cos(q[0]) + GAMMA * z


def moved(x, k, h):
    return tuple(a + h * b for a, b in zip(x, k))


def runge_kutta(q, p, z, h=0.5):
    x = q, p, z
    k1 = rates(*x)
    k2 = rates(*moved(x, k1, h / 2))
    k3 = rates(*moved(x, k2, h / 2))
    k4 = rates(*moved(x, k3, h))
    return tuple(a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(x, k1, k2, k3, k4))


def test_a_step_of_runge_and_kutta_is_not_contact():
    at = [1.0], [0.3], 0.2
    found = hz.is_contact(runge_kutta, at)
    assert not found and 1e-6 < found.defect < 1e-2 and str(found).startswith("not contact")
    # The defect decreases with the step, as the local error does, which is of fifth order.
    finer = hz.is_contact(lambda q, p, z: runge_kutta(q, p, z, 0.25), at)
    assert 4.5 < np.log2(found.defect / finer.defect) < 5.5
    assert found.sigma == pytest.approx(np.exp(GAMMA * 0.5), abs=1e-3)


def test_contact_maps_are_contact():
    at = [0.7, -0.2], [0.3, 0.4], 0.2
    kick = lambda q, p, z: (q, p - 0.1 * np.sin(q), z + 0.1 * np.sum(np.cos(q)))
    drift = lambda q, p, z: (q + 0.1 * p, p, z + 0.05 * p @ p)
    scale = lambda q, p, z: (q, 0.9 * p, 0.9 * z)
    step = lambda q, p, z: scale(*drift(*kick(q, p, z)))
    found = hz.is_contact(step, at)
    assert found and found.sigma == pytest.approx(0.9, rel=1e-14) and found.defect < 1e-15
    assert found.jacobian.shape == (5, 5) and found.image.shape == (5,)
    assert np.allclose(found.image, np.concatenate([*map(np.ravel, step(*map(np.array, at)))]), rtol=1e-14)


def test_a_factor_of_nothing_is_not_contact():
    # The pullback of dz - p dq by each of these maps is 0: onto a point, a Legendrian curve, the momenta at one
    # position.
    for map in (
        lambda q, p, z: (0 * q, 0 * p, 0 * z),
        lambda q, p, z: (q, np.cos(q), np.sum(np.sin(q))),
        lambda q, p, z: (0 * q, p, 0 * z),
    ):
        found = hz.is_contact(map, ([1.0], [0.3], 0.2))
        assert not found and found.sigma == 0.0 and "sigma is 0" in str(found)
    # The conformal factor may be small.
    assert hz.is_contact(lambda q, p, z: (q, 1e-200 * p, 1e-200 * z), ([1.0], [0.3], 0.2))


def test_maps_and_points_are_checked():
    identity = lambda q, p, z: (q, p, z)
    for at in ([1.0], ([1.0], [1.0, 2.0], 0.0), ([1.0], [np.nan], 0.0), ([], [], 0.0)):
        with pytest.raises(ValueError):
            hz.is_contact(identity, at)
    with pytest.raises(ValueError, match="tuple"):
        hz.is_contact(lambda q, p, z: q, ([1.0], [1.0], 0.0))
    with pytest.raises(ValueError, match="but there are 1"):
        hz.is_contact(lambda q, p, z: (np.concatenate([q, q]), p, z), ([1.0], [1.0], 0.0))


def test_the_geometry_at_a_point():
    at = hz.geometry(
        "m*x'^2/2 + x*y' + y'^2/2 + c*x'*z - x^2",
        0.0,
        [0.5, 0.2],
        [0.3, 0.7],
        0.4,
        coordinates=["x", "y"],
        parameters={"m": 2.0, "c": 0.1},
    )
    p = [2 * 0.3 + 0.1 * 0.4, 0.5 + 0.7]
    assert np.allclose(at.momentum, p) and np.allclose(at.mass, [[2, 0], [0, 1]]) and at.rate == pytest.approx(0.03)
    assert np.allclose(at.eta, [-p[0], -p[1], 0, 0, 1])
    # R = d/dz - W^-1 L_vz d/dv.
    assert np.allclose(at.reeb, [0, 0, -0.1 / 2, 0, 1]) and at.eta @ at.reeb == pytest.approx(1)
    assert at.energy == pytest.approx(np.dot([0.3, 0.7], p) - at.lagrangian)
    assert np.allclose(at.herglotz_field[[0, 1, 4]], [0.3, 0.7, at.lagrangian])
    with pytest.raises(ValueError):
        hz.geometry("x'", 0.0, [0.5], [0.3], coordinates=["x"])


def test_a_check_of_contact_steps():
    found = hz.check(L, [1.0], [0.3], 10.0, integrator="gauss_4", step=0.25, places=4)
    assert found and found.integrator == "gauss_4" and found.step == 0.25 and len(found.places) >= 4
    assert all(place.contact_defect < 1e-9 for place in found.places)
    assert found.places[1].sigma == pytest.approx(np.exp(GAMMA * 0.25), rel=1e-9)
    assert found.statements and all(residual < 1e-8 for _, _, residual in found.statements)


def test_a_comparison_ranks_integrators():
    found = hz.compare("x'^2/2 - x^2/2 - 0.05*z^2", [1.0], [0.0], 2.0, z0=1.0, coordinates=["x"])
    order = {row.integrator: row.order for row in found.rows}
    assert order["midpoint"] == 2 and order["gauss_4"] == 8
    midpoint = [row for row in found.rows if row.integrator == "midpoint" and 1e-10 < row.error < 1e-3]
    slopes = [np.log(a.error / b.error) / np.log(a.step / b.step) for a, b in zip(midpoint, midpoint[1:])]
    assert len(slopes) >= 3 and all(abs(slope - 2) < 0.15 for slope in slopes)
    best = found.best(1e-9)
    assert best.error <= 1e-9 and all(row.seconds >= best.seconds for row in found.rows if row.error <= 1e-9)
    assert found.best(0.0) is None or found.best(0.0).error == 0.0
    assert list(found.to_pandas().columns)[:2] == ["integrator", "order"]
