"""Motions that come to rest before the end that was requested: they stay there, in every output."""

import herglotz as hz
import numpy as np
import pytest

# x comes to rest at 0 and z at c/g, by t = 700; e^-t falls below the smallest number.
FORMULA = dict(coordinates=["x"], parameters={"c": 0.5, "g": 2.0})
L = "x'^2/2 - x^2/2 + c - g*z"
WAYS = [dict(accuracy=1e-9), dict(integrator="gauss_8", step=0.5), dict(integrator="gauss_3", step=0.125)]


@pytest.mark.parametrize("way", WAYS)
def test_rows_after_rest(way):
    for t in (1e5, [0.0, 1e5], [0.0, 10.0, 5e4, 1e5]):
        sol = hz.solve(L, [1.0], [0.0], t, **way, **FORMULA)
        assert sol.success and sol.status == "completed" and sol.t_end == 1e5 and sol.unresolved is None
        assert sol.t[-1] == 1e5 and abs(sol.q[-1, 0]) < 1e-270 and abs(sol.z[-1] - 0.25) < 1e-14


@pytest.mark.parametrize("way", WAYS)
def test_dense_output_at_rest(way):
    sol = hz.solve(L, [1.0], [0.0], [0.0, 1e5], **way, **FORMULA)
    early = hz.solve(L, [1.0], [0.0], [0.0, 7.3, 10.0], accuracy=1e-11, **FORMULA)
    found = sol([7.3, 10.0, 3e3, 4.5e4, 1e5])
    # Of three stages with steps of 1/8.
    assert np.max(np.abs(found.q[:2, 0] - early.q[1:, 0])) < 1e-5
    assert np.max(np.abs(found.q[2:])) < 1e-270 and np.max(np.abs(found.z[2:] - 0.25)) < 1e-14


@pytest.mark.parametrize("way", WAYS)
def test_derivatives_at_rest(way):
    sol = hz.solve(L, [1.0], [0.0], [0.0, 5e4, 1e5], **way, **FORMULA)
    found = sol.sensitivity(["x", "c", "g"])
    assert np.max(np.abs(found.q[1:])) < 1e-12
    assert np.allclose(found.z[1:], [0.0, 0.5, -0.125], rtol=0, atol=1e-12)
    gradient = sol.pullback(z=np.array([0.0, 1.0, 1.0]))
    assert abs(gradient.parameters["c"] - 1.0) < 1e-12 and abs(gradient.parameters["g"] + 0.25) < 1e-12
    value, gradient = hz.value_and_grad("4*z + x")(L, [1.0], [0.0], 1e5, **way, **FORMULA)
    assert abs(value - 1.0) < 1e-13 and abs(gradient.parameters["c"] - 2.0) < 1e-12


def test_what_follows_rest():
    sol = hz.solve(L, [1.0], [0.0], [0.0, 1e5], events=["t - 9e4"], **FORMULA)
    assert np.allclose(sol.events[0].t, 9e4, rtol=1e-14)
    more = sol.resume([1.5e5, 2e5])
    assert more.success and np.max(np.abs(more.q)) < 1e-270 and np.max(np.abs(more.z - 0.25)) < 1e-14
