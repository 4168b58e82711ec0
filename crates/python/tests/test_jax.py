"""Motions that JAX differentiates."""

import herglotz as hz
import numpy as np
import pytest

jax = pytest.importorskip("jax")
jax.config.update("jax_enable_x64", True)

import herglotz.jax as hj  # noqa: E402

L = "x'^2/2 - 1 + cos(x) + gamma*z"
GIVEN = dict(coordinates=["x"], integrator="gauss_8", steps=40)


def loss(q0, v0, z0, gamma):
    rows = hj.solve(L, q0, v0, np.linspace(0, 10, 5), z0=z0, parameters={"gamma": gamma}, **GIVEN)
    return jax.numpy.sum(rows.q[:, 0] * rows.v[:, 0]) + rows.z[-1] ** 2


AT = np.array([1.0]), np.array([1.0]), 0.1, -0.01


def test_gradients_are_those_of_differences():
    found = jax.grad(loss, argnums=(0, 1, 2, 3))(*AT)
    for k, slope in enumerate(found):
        near = []
        for sign in (1, -1):
            at = list(AT)
            at[k] = at[k] + sign * 1e-5
            near.append(loss(*at))
        assert abs(np.ravel(slope)[0] - (near[0] - near[1]) / 2e-5) <= 1e-7 * abs(np.ravel(slope)[0])


def test_compiled_and_mapped():
    value, slope = jax.jit(jax.value_and_grad(loss, argnums=3))(*AT)
    near = lambda a, b: abs(a - b) <= 1e-13 * abs(b)  # The compiled sum of the rows is rounded differently.
    assert near(value, loss(*AT)) and near(slope, jax.grad(loss, argnums=3)(*AT))
    gammas = np.array([-0.01, -0.02])
    mapped = jax.vmap(jax.grad(loss, argnums=3), in_axes=(None, None, None, 0))(*AT[:3], gammas)
    assert all(near(found, jax.grad(loss, argnums=3)(*AT[:3], gamma)) for found, gamma in zip(mapped, gammas))


def test_functions_and_the_reference():
    def final(gamma):
        def pendulum(t, q, v, z, gamma):
            return v @ v / 2 - 1 + np.cos(q[0]) + gamma * z

        rows = hj.solve(pendulum, [1.0], [1.0], 100.0, parameters={"gamma": gamma}, integrator="gauss_8", steps=400)
        return rows.q[-1, 0]

    assert abs(jax.grad(final)(-0.01) - 225.145071391822) <= 225 * 1e-11


def test_invalid_input():
    with pytest.raises(ValueError, match="did you mean 'gamma'"):
        hj.solve(L, [1.0], [1.0], 1.0, parameters={"gamma": -0.1, "gama": 1.0}, **GIVEN)
    with pytest.raises(ValueError, match="they must be"):
        hj.solve("pendulum", [1.0], [1.0, 2.0], 1.0)
    with pytest.raises(ValueError, match="`events` cannot be given here"):
        hj.solve("pendulum", [1.0], [1.0], 1.0, events="theta")
    with pytest.raises(Exception, match="not completed"):
        hj.solve("x'^2/2 + 1/x", [1.0], [0.0], 5.0, coordinates=["x"], integrator="gauss_4", steps=50).q.block_until_ready()
    assert hz.solve("pendulum", t=1.0).success
