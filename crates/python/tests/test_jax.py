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


def test_forward_mode_is_that_of_the_tangents():
    rows = lambda q0, v0, z0, gamma: hj.solve(L, q0, v0, np.linspace(0, 10, 5), z0=z0, parameters={"gamma": gamma}, **GIVEN)
    sol = hz.solve(L, *AT[:2], np.linspace(0, 10, 5), z0=0.1, parameters={"gamma": -0.01}, **GIVEN)
    expected = sol.sensitivity(["x", "x'", "z", "gamma"])
    found = jax.jacfwd(rows, argnums=(0, 1, 2, 3))(*AT)
    # Contractions with unit vectors are exact.
    for columns, of in zip(found, (expected.q, expected.v, expected.z)):
        columns = [np.reshape(column, of.shape[:-1]) for column in columns]
        assert np.array_equal(np.stack(columns, axis=-1), of)
    value, slope = jax.jvp(rows, AT, (np.array([0.5]), np.array([0.0]), 0.0, 2.0))
    assert np.array_equal(value.q, sol.q)
    assert np.allclose(slope.q, 0.5 * expected.q[..., 0] + 2.0 * expected.q[..., 3], rtol=1e-14, atol=0)
    back = jax.jacrev(rows, argnums=(0, 3))(*AT)
    assert np.allclose(back.q[0][..., 0], expected.q[..., 0], rtol=1e-11, atol=1e-11)
    assert np.allclose(back.z[1], expected.z[..., 3], rtol=1e-11, atol=1e-11)
    assert np.allclose(jax.jit(jax.jacfwd(rows, argnums=3))(*AT).q, expected.q[..., 3], rtol=1e-13, atol=0)


def test_batches_are_ensembles(monkeypatch):
    from herglotz import _differentiable

    calls = []

    def count(name, members_of):
        run = getattr(_differentiable, name)
        monkeypatch.setattr(_differentiable, name, lambda *given, **named: calls.append(members_of(given)) or run(*given, **named))

    count("ensemble", lambda given: len(given[1]))
    count("pullback_of", lambda given: len(given[1][0][0]))
    q0, gammas = np.linspace(0.5, 1.5, 6)[:, None], np.linspace(-0.05, 0.05, 4)
    at = lambda q0, gamma: loss(q0, AT[1], AT[2], gamma)
    batch = jax.vmap(at, in_axes=(0, None))(q0, gammas[0])
    assert calls == [6] and all(abs(found - at(q, gammas[0])) <= 1e-13 * abs(found) for found, q in zip(batch, q0))
    # Two axes of a batch, under jit, with gradients in both arguments.
    calls.clear()
    of = jax.jit(jax.vmap(jax.vmap(jax.grad(at, argnums=(0, 1)), in_axes=(None, 0)), in_axes=(0, None)))
    of_q0, of_gamma = of(q0, gammas)
    assert of_q0.shape == (6, 4, 1) and of_gamma.shape == (6, 4) and set(calls) == {24}
    for i, j in ((0, 0), (5, 3), (2, 1)):
        expected = jax.grad(at, argnums=(0, 1))(q0[i], gammas[j])
        assert np.allclose(of_q0[i, j], expected[0], rtol=1e-12) and np.allclose(of_gamma[i, j], expected[1], rtol=1e-12)
    # The gradient of the sum over a batch, in a shared parameter and in the starts.
    total = lambda q0, gamma: jax.numpy.sum(jax.vmap(at, in_axes=(0, None))(q0, gamma))
    of_q0, of_gamma = jax.grad(total, argnums=(0, 1))(q0, -0.01)
    each = [jax.grad(at, argnums=(0, 1))(q, -0.01) for q in q0]
    assert np.allclose(of_q0, [q for q, _ in each], rtol=1e-12) and np.allclose(of_gamma, sum(g for _, g in each), rtol=1e-12)
    # Forward over a batch.
    found = jax.vmap(lambda q0, gamma: jax.jvp(lambda gamma: at(q0, gamma), (gamma,), (1.0,))[1], in_axes=(0, None))(q0, -0.01)
    assert np.allclose(found, [g for _, g in each], rtol=1e-11)
    assert np.allclose(jax.jacfwd(total, argnums=1)(q0, -0.01), of_gamma, rtol=1e-11)


@pytest.mark.parametrize("options", [dict(accuracy=1e-8), dict(accuracy=1e-8, scales=[2.0]), dict(integrator="strang", step=0.1)])
def test_batches_with_other_steps(options):
    final = lambda q0: hj.solve(L, q0, AT[1], 3.0, parameters={"gamma": -0.01}, coordinates=["x"], threads=2, **options).q[-1, 0]
    q0 = np.linspace(0.5, 1.5, 3)[:, None]
    values, slopes = jax.vmap(jax.value_and_grad(final))(q0)
    for value, slope, q in zip(values, slopes, q0):
        assert abs(value - final(q)) <= 1e-7 and abs(slope[0] - jax.grad(final)(q)[0]) <= 1e-6


def test_what_is_not_possible_is_said():
    with pytest.raises(NotImplementedError, match="second derivatives of motions"):
        jax.hessian(loss, argnums=3)(*AT)
    fall = lambda q0: hj.solve("x'^2/2 + 1/x", q0, [0.0], 0.5, coordinates=["x"], integrator="gauss_4", steps=10).q[-1, 0]
    q0 = np.array([[1.0], [0.01], [2.0]])
    with pytest.raises(Exception, match="motion 1 of the batch was not completed"):
        jax.block_until_ready(jax.vmap(fall)(q0))
    with pytest.raises(Exception, match="motion 1 of the batch"):
        jax.block_until_ready(jax.vmap(jax.grad(fall))(q0))


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
    terminal = hz.Event("theta", terminal=True)
    with pytest.raises(Exception, match="terminal event"):
        jax.grad(lambda x: hj.solve("pendulum", [x], [1.0], 1.0, events=terminal).q[-1, 0])(1.0)
    with pytest.raises(Exception, match="not completed"):
        hj.solve("x'^2/2 + 1/x", [1.0], [0.0], 5.0, coordinates=["x"], integrator="gauss_4", steps=50).q.block_until_ready()
    assert hz.solve("pendulum", t=1.0).success
