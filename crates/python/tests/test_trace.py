"""Traced functions: compared with formulas, and functions that cannot be traced."""

import math

import herglotz as hz
import numpy as np
import pytest
import sympy

STATE = dict(t=0.3, q=[0.7, -0.4], v=[0.2, 0.5], z=0.1)


def value(L):
    """The value of L at a state by tracing; a kinetic term makes the Lagrangian regular."""
    traced = hz.system(lambda t, q, v, z: v @ v / 2 + L(t, q, v, z), n=2)
    found = hz.geometry(traced, *STATE.values()).lagrangian
    v = np.array(STATE["v"])
    return found - v @ v / 2


# Each is also evaluated with numbers: the trace must agree with NumPy.
FUNCTIONS = [
    lambda t, q, v, z: np.sin(q[0]) * np.cos(q[1]) + np.tan(q[0]),
    lambda t, q, v, z: np.exp(-q @ q) + np.expm1(q[0]) + np.log(q[0]) + np.log1p(q[0]),
    lambda t, q, v, z: np.sqrt(q[0]) + q[0] ** 2.5 + q[0] ** -3 + 2.0 ** q[0] + q[0] ** q[0],
    lambda t, q, v, z: np.arcsin(q[0]) + np.arccos(q[1]) + np.arctan(q[0]) + np.arctan2(q[0], q[1]),
    lambda t, q, v, z: np.sinh(q[0]) + np.cosh(q[0]) + np.tanh(q[0]) + np.arcsinh(q[0]) + np.arctanh(q[0]),
    lambda t, q, v, z: np.arccosh(1 + q[0]) + np.hypot(q[0], q[1]) + np.log2(q[0]) + np.log10(q[0]),
    lambda t, q, v, z: np.linalg.norm(q) + np.linalg.norm(q - v, 1) + np.linalg.norm(q, np.inf),
    lambda t, q, v, z: np.where(q[0] < q[1], z, 2 * z) + np.where(q > 0, q, -q) @ q,
    lambda t, q, v, z: np.where((q[0] > 0) & ~(q[1] > 0) | (q[0] > 5), 1.5, z),
    lambda t, q, v, z: np.minimum(q[0], 0.5) + np.maximum(q[1], 0.1) + np.abs(q).sum() + np.sign(q[1]),
    lambda t, q, v, z: np.max(q) - np.min(q) + np.clip(q[0], 0, 0.5) + np.prod(q) + np.mean(q),
    lambda t, q, v, z: np.dot(q, v) + np.inner(q, v) + np.sum(q[::-1] * v) + np.einsum("i,i", q, v) + np.vdot(q, v),
    lambda t, q, v, z: q @ np.array([[2.0, 1.0], [1.0, 3.0]]) @ q + np.trace(np.outer(q, v)),
    lambda t, q, v, z: (
        np.sum(np.diff(np.concatenate([q, v, [0.0]])) ** 2) + np.sum(np.roll(q, 1) * v) + np.cumsum(q)[-1]
    ),
    lambda t, q, v, z: (
        np.stack([q, v]).sum() + np.sum(np.array([q[0], 2.0 * v[1]])) + np.float64(2) * q[0] + q[0] / np.int64(3)
    ),
    lambda t, q, v, z: np.sum(np.sin(np.array([q[0], v[1]]))) + np.linalg.norm(hz.array([q[0], 1.0])),
    lambda t, q, v, z: (lambda w: w[0] * z + np.square(w[1]) + np.reciprocal(w[0]))(np.exp(q) - t),
    lambda t, q, v, z: sum(float(i) * x for i, x in enumerate(q)) - (-q[0]) + abs(q[1]) + +z,
    lambda t, q, v, z: (
        np.select([q[0] < 0, q[0] < 1], [z, 2 * z], 3 * z) + np.linalg.norm(np.cross([*q, 1.0], [*v, z])[:2])
    ),
]


@pytest.mark.parametrize("L", FUNCTIONS)
def test_a_trace_is_what_numpy_computes(L):
    with np.errstate(all="raise"):
        t, q, v, z = STATE.values()
        wanted = float(L(t, np.array(q), np.array(v), z))
    # About a dozen operations, each with a rounding error or two.
    assert value(L) == pytest.approx(wanted, rel=2e-14)


def test_a_function_is_the_formula():
    def L(t, q, v, z, gamma):
        return v @ v / 2 + np.cos(q[0]) + gamma * z

    t = np.linspace(0, 10, 11)
    by_function = hz.solve(L, [1.0], [0.0], t, parameters={"gamma": -0.1})
    text = "x'^2/2 + cos(x) + gamma*z"
    by_text = hz.solve(text, [1.0], [0.0], t, coordinates=["x"], parameters={"gamma": -0.1})
    assert np.array_equal(by_function.q, by_text.q) and np.array_equal(by_function.z, by_text.z)
    named = hz.solve(L, [1.0], [0.0], t, parameters={"gamma": -0.1}, coordinates=["theta"], events="theta")
    assert np.array_equal(named.q, by_text.q) and len(named.events[0].t) == 3


def test_a_closure_that_changes_is_traced_anew():
    stiffness = 1.0

    def L(t, q, v, z):
        return v @ v / 2 - stiffness * q @ q / 2

    first = hz.solve(L, [1.0], [0.0], np.pi).q[-1, 0]
    stiffness = 4.0
    second = hz.solve(L, [1.0], [0.0], np.pi).q[-1, 0]
    assert first == pytest.approx(-1, abs=1e-8) and second == pytest.approx(1, abs=1e-8)


def test_shared_parts_do_not_grow():
    def L(t, q, v, z):
        x = q[0]
        for _ in range(60):
            x = x * x / 2 + x / 3
        return v @ v / 2 - x

    assert len(hz.system(L, n=1).lagrangian) < 10_000


def test_a_deep_function_is_read():
    def L(t, q, v, z):
        x = q[0]
        for _ in range(500):
            x = np.sin(x + 1.0)
        return v @ v / 2 - x

    assert hz.solve(L, [0.1], [0.0], 0.1).success


def branch(t, q, v, z):
    return v @ v / 2 if q[0] > 0 else v @ v


@pytest.mark.parametrize(
    "L",
    [
        branch,
        lambda t, q, v, z: v @ v / 2 - math.cos(q[0]),
        lambda t, q, v, z: v @ v / 2 - max(q[0], 1.0),
        lambda t, q, v, z: v @ v / 2 - float(q[0]),
        lambda t, q, v, z: v @ v / 2 if q[0] > 0 and z < 1 else z,
        lambda t, q, v, z: v @ v / 2 - [1.0, 2.0][q[0]],
    ],
)
def test_control_flow_is_a_type_error(L):
    with pytest.raises(TypeError, match=r"np\.where"):
        hz.solve(L, [1.0], [0.0], 1.0)


def test_what_is_not_traced_says_so():
    with pytest.raises(TypeError, match="np.floor"):
        hz.solve(lambda t, q, v, z: v @ v - np.floor(q[0]), [1.0], [0.0], 1.0)
    with pytest.raises(ValueError, match=r"shape \(1,\)"):
        hz.solve(lambda t, q, v, z: v * v, [1.0], [0.0], 1.0)
    with pytest.raises(ValueError, match="check its return"):
        hz.solve(lambda t, q, v, z: None, [1.0], [0.0], 1.0)
    with pytest.raises(ValueError, match="parameter 'k'"):
        hz.solve(lambda t, q, v, z, k: k * v @ v, [1.0], [0.0], 1.0)
    with pytest.raises(ValueError, match="not finite"):
        hz.solve(lambda t, q, v, z: np.nan * v @ v, [1.0], [0.0], 1.0)
    kept = []
    hz.solve(lambda t, q, v, z: kept.append(q[0]) or v @ v / 2, [1.0], [0.0], 1.0)
    with pytest.raises(ValueError, match="another call"):
        hz.solve(lambda t, q, v, z: v @ v / 2 - kept[0], [1.0], [0.0], 1.0)


def test_expressions_of_sympy():
    wanted = hz.solve("x'^2/2 + cos(x) + gamma*z", [1.0], [0.0], 5.0, coordinates=["x"], parameters={"gamma": -0.1}).q
    x, xdot, z, gamma, t = sympy.symbols("x xdot z gamma t")
    L = xdot**2 / 2 + sympy.cos(x) + gamma * z
    found = hz.solve(L, [1.0], [0.0], 5.0, coordinates=[x], parameters={"gamma": -0.1})
    assert np.allclose(found.q, wanted, rtol=1e-12)
    theta = sympy.Function("theta")(t)
    L = theta.diff(t) ** 2 / 2 + sympy.cos(theta) - z / 10
    found = hz.solve(L, [1.0], [0.0], 5.0, events="theta")
    assert np.allclose(found.q, wanted, rtol=1e-9)
    piecewise = xdot**2 / 2 - sympy.Piecewise((x, x < 0), (x**2, True))
    assert hz.geometry(piecewise, 0, [2.0], [0.0], coordinates=[x]).lagrangian == -4.0
    with pytest.raises(ValueError, match="`gamma`"):
        hz.solve(xdot**2 + gamma * z, [1.0], [0.0], 5.0, coordinates=[x])
