"""The exact discrete Lagrangian: its theorems, and comparison with motions of `solve`."""

import herglotz as hz
import numpy as np
import pytest


def L(t, q, v, z):
    return v @ v / 2 + np.cos(q[0]) * np.cos(q[1]) - 0.1 * z - 0.05 * z * z


Q0, V0, Z0, H = [1.0, 0.2], [0.3, -0.4], 0.1, 0.5


def test_the_retraction_is_the_inverse_of_the_exponential():
    there = hz.exponential(L, H, Q0, V0, Z0)
    assert there.regularity == pytest.approx(H, rel=0.2)
    back = hz.retract(L, H, Q0, there.q1, Z0)
    assert np.allclose(back.v0, V0, rtol=1e-13)
    sol = hz.solve(L, Q0, V0, H, z0=Z0, accuracy=1e-13)
    assert np.allclose(there.q1, sol.q[-1], rtol=1e-12) and np.allclose(back.v1, sol.v[-1], rtol=1e-12)
    assert back.z1 == pytest.approx(sol.z[-1], rel=1e-12) and back.action == pytest.approx(sol.z[-1] - Z0, rel=1e-12)


def test_the_derivatives_are_momenta():
    q1 = hz.exponential(L, H, Q0, V0, Z0).q1
    exact, motion = hz.exact_lagrangian(L, H, Q0, q1, Z0), hz.retract(L, H, Q0, q1, Z0)
    assert exact.value == pytest.approx(motion.action, rel=1e-13)
    # W is the identity: momenta equal velocities.
    assert np.allclose(exact.d2, motion.v1, rtol=1e-12) and np.allclose(-exact.d1 / exact.sigma, V0, rtol=1e-12)
    assert exact.sigma == pytest.approx(1 + exact.dz, rel=1e-14) and exact.sigma == pytest.approx(
        motion.sigma, rel=1e-13
    )
    e = 1e-5
    slope = (
        hz.exact_lagrangian(L, H, Q0, q1 + [e, 0], Z0).value - hz.exact_lagrangian(L, H, Q0, q1 - [e, 0], Z0).value
    ) / (2 * e)
    assert slope == pytest.approx(exact.d2[0], rel=1e-8)


def test_five_coordinates():
    """Five coordinates are computed with the code for eight; the additional ones are not visible."""

    def chain(t, q, v, z):
        bonds = sum((q[i + 1] - q[i]) ** 4 for i in range(4))
        return 2 * (v @ v) - bonds - np.cos(q[0]) - 0.1 * z - 0.05 * z * z

    q0, v0 = np.linspace(0.1, 0.5, 5), np.linspace(0.4, -0.2, 5)
    there = hz.exponential(chain, H, q0, v0, Z0)
    assert there.q1.shape == (5,) and there.regularity == pytest.approx(H, rel=0.2)
    back = hz.retract(chain, H, q0, there.q1, Z0)
    assert np.allclose(back.v0, v0, rtol=1e-12) and back.v1.shape == (5,)
    exact = hz.exact_lagrangian(chain, H, q0, there.q1, Z0)
    assert exact.value == pytest.approx(back.action, rel=1e-13)
    # W is 4 times the identity.
    assert np.allclose(exact.d2, 4 * back.v1, rtol=1e-11) and np.allclose(-exact.d1 / exact.sigma, 4 * v0, rtol=1e-11)


def test_bad_input_is_named():
    with pytest.raises(ValueError, match="`q1` has 1"):
        hz.retract(L, H, Q0, [1.0])
    with pytest.raises(ValueError, match="`h` is nan"):
        hz.retract(L, np.nan, Q0, Q0)
    with pytest.raises(ValueError):
        hz.retract(L, -1.0, Q0, Q0)
    with pytest.raises(ValueError, match="compiled for 1 to 8"):
        hz.exponential("sum(i, 0, n-1, v[i]^2)", H, np.ones(9), np.ones(9))


def test_what_has_no_exact_lagrangian_is_refused():
    """Constraints, forces and Hamiltonians would be ignored."""
    systems = {
        "not computed with constraints": hz.system("(x'^2 + y'^2)/2 - 9.81*y", ["x", "y"], constraints="x^2 + y^2 = 1"),
        "has a force": hz.system("(x'^2 + y'^2)/2", ["x", "y"], force={"x": "-x'"}),
        "not computed for a Hamiltonian": hz.system(H="(p_x^2 + p_y^2)/2", coordinates=["x", "y"]),
    }
    for said, of in systems.items():
        for call in (
            lambda: hz.exponential(of, 0.1, [0.0, -1.0], [1.0, 0.0]),
            lambda: hz.retract(of, 0.1, [0.0, -1.0], [0.1, -0.99]),
            lambda: hz.exact_lagrangian(of, 0.1, [0.0, -1.0], [0.1, -0.99]),
        ):
            with pytest.raises(ValueError, match=said) as caught:
                call()
            assert "Formula::" not in str(caught.value)
