"""Contact Hamiltonians: functions and formulas, names of the momenta and of the action, geometry, refusals."""

import pickle

import herglotz as hz
import numpy as np
import pytest


def test_a_function_is_traced_with_momenta():
    def H(t, q, p, z):
        return p @ p / 2 + np.cos(q[0]) + 0.1 * z

    def L(t, q, v, z):
        return v @ v / 2 - np.cos(q[0]) - 0.1 * z

    t = np.linspace(0, 10, 11)
    of_h, of_l = (
        hz.solve(**given, q0=[1.0], p0=[0.3], t=t, integrator="gauss_8", steps=50) for given in (dict(H=H), dict(L=L))
    )
    # Fifty steps of order 16 are exact to round-off.
    for name in ("q", "v", "p", "z", "energy"):
        assert np.allclose(getattr(of_h, name), getattr(of_l, name), rtol=0, atol=1e-11), name
    # From a velocity, which here is the momentum.
    assert np.allclose(hz.solve(H=H, q0=[1.0], v0=[0.3], t=t, integrator="gauss_8", steps=50).q, of_h.q, atol=1e-13)


def test_a_hamiltonian_that_is_linear_in_p():
    sol = hz.solve(
        H="-p_x*x^3 + k*z",
        coordinates=["x"],
        parameters={"k": 0.5},
        q0=[1.0],
        p0=[2.0],
        t=[0.0, 1.0, 2.0],
        accuracy=1e-10,
        observe={"kept": "p_x*x^3*exp(k*t)", "velocity": "x'"},
        conformal_factor=True,
    )
    assert np.allclose(sol.q[:, 0], 1 / np.sqrt(1 + 2 * sol.t), atol=1e-9)
    assert np.allclose(sol["kept"], 2, atol=1e-8)
    assert np.allclose(sol["velocity"], -sol.q[:, 0] ** 3, atol=1e-9)
    assert np.allclose(sol.log_factor, -0.5 * sol.t, atol=1e-9)
    with pytest.raises(ValueError, match="start from a momentum"):
        hz.solve(H="p_x*x", coordinates=["x"], q0=[1.0], v0=[0.0], t=1.0)


def test_names_of_momenta_and_of_the_action():
    of = hz.system(H="(l^2 + m^2 + n_z^2)/2 + s/2", coordinates=["x", "y", "z"], momenta=["l", "m", "n_z"], action="s")
    assert of.momenta == ["l", "m", "n_z"]
    sol = hz.solve(of, [0.0] * 3, p0=[1.0, 2.0, 3.0], t=2.0, accuracy=1e-10)
    assert np.allclose(sol.p[-1], np.exp(-1) * np.array([1, 2, 3]), atol=1e-8)
    assert "homogeneous" not in of.structure and "separable" in of.structure
    again = pickle.loads(pickle.dumps(of))
    assert again.kind == of.kind and again.coordinates == ["x", "y", "z"]
    thrown = hz.solve("(x'^2 + z'^2)/2 - z", [0.0, 0.0], [1.0, 1.0], 1.0, coordinates=["x", "z"], action="s")
    assert np.allclose(thrown.q[-1], [1.0, 0.5])


def test_geometry():
    found = hz.geometry(H=lambda t, q, p, z: p @ p / 2 + q @ q / 2 + 0.1 * z, q=[1.0], p=[2.0], z=3.0)
    assert np.allclose(found.field, [2.0, -1.2, 1.2])
    assert np.allclose(found.lie_derivative, found.rate * found.eta)
    assert np.allclose(found.brackets, [2.1, -1.0, 1.5])


@pytest.mark.parametrize(
    "given, message",
    [
        (dict(L="x'^2", H="p_x"), "give either `L` or `H`"),
        (dict(), "give either `L` or `H`"),
        (dict(L="x'^2", momenta=["p"]), "`momenta` are names for `H`"),
        (dict(H="x'^2"), "a Hamiltonian depends on momenta"),
        (dict(H="p", momenta=["p", "r"]), "names of 2 momenta for 1 coordinates"),
        (dict(H="p_x", action="x"), "is that of the action"),
        (dict(H="p_x", action=3), "`action` is 3"),
        (dict(H="p_x", force={"x": "1"}), "has no forces"),
        (dict(H="p_x", integrator="midpoint", steps=3), "a Hamiltonian runs by"),
        (dict(H="p_x/x"), "not finite at the start"),
    ],
)
def test_refusals(given, message):
    with pytest.raises(ValueError, match=message):
        hz.solve(**given, coordinates=["x"], q0=[0.0], p0=[1.0], t=1.0)
