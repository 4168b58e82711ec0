"""Motions that PyTorch differentiates."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

import herglotz.torch as ht  # noqa: E402

L = "x'^2/2 - 1 + cos(x) + gamma*z"
GIVEN = dict(coordinates=["x"], integrator="gauss_8", steps=40)


def tensors(*values):
    return [torch.tensor(value, dtype=torch.float64, requires_grad=True) for value in values]


def rows(q0, v0, z0, gamma):
    return ht.solve(L, q0, v0, np.linspace(0, 10, 5), z0=z0, parameters={"gamma": gamma}, **GIVEN)


def test_gradients_are_those_of_differences():
    assert torch.autograd.gradcheck(lambda *x: tuple(rows(*x)), tensors([1.0], [1.0], 0.1, -0.01), eps=1e-5, atol=1e-6)


def test_the_reference():
    gamma, q0, v0 = tensors(-0.01, [1.0], [1.0])
    options = dict(coordinates=["x"], integrator="gauss_8", steps=400)
    found = ht.solve(L, q0, v0, 100.0, parameters={"gamma": gamma}, **options)
    found.q[-1, 0].backward()
    for slope, expected in ((gamma.grad, 225.145071391822), (q0.grad, 5.65210486970), (v0.grad, 7.38154595869)):
        assert abs(slope.item() - expected) <= 1e-11 * 225


def test_invalid_input():
    with pytest.raises(ValueError, match="did you mean 'gamma'"):
        ht.solve(L, [1.0], [1.0], 1.0, parameters={"gamma": -0.1, "gama": 1.0}, **GIVEN)
    with pytest.raises(ValueError, match="not completed"):
        ht.solve("x'^2/2 + 1/x", [1.0], [0.0], 5.0, coordinates=["x"], integrator="gauss_4", steps=50)
