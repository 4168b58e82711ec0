"""Derivatives of the members of ensembles: those of single motions, bitwise."""

import herglotz as hz
import numpy as np
import pytest

L = "x'^2/2 - k*(1 - cos(x)) + gamma*z"
M = 20
Q, V = np.linspace(0.1, 2.0, M)[:, None], np.linspace(-0.5, 0.5, M)[:, None]
K = np.linspace(0.8, 1.2, M)
GIVEN = dict(coordinates=["x"], integrator="gauss_6", step=0.25)
PARAMETERS = {"gamma": -0.1, "k": K}


def member(i, t, **more):
    return hz.solve(L, Q[i], V[i], t, parameters={"gamma": -0.1, "k": K[i]}, **GIVEN | more)


@pytest.mark.parametrize("integrator", ["gauss_6", "strang", "midpoint"])
def test_pullbacks_and_sensitivities_are_those_of_members(integrator):
    t = np.array([0.0, 1.3, 5.0])
    rng = np.random.default_rng(1)
    q, z = rng.normal(size=(M, 3, 1)), rng.normal(size=(M, 3))
    found = []
    for threads in (1, 2):
        many = hz.ensemble(L, Q, V, t, parameters=PARAMETERS, threads=threads, **GIVEN | dict(integrator=integrator))
        found.append((many.pullback(q=q, z=z), many.sensitivity(["x", "k", "gamma"])))
    (slopes, sensitivity), again = found
    assert all(np.array_equal(a, b) for a, b in zip(slopes[:2], again[0][:2])) and np.array_equal(sensitivity.q, again[1].q)
    assert slopes.p0 is None and slopes.troubles == {} and sensitivity.q.shape == (M, 3, 1, 3)
    for i in (0, 7, M - 1):
        one = member(i, t, integrator=integrator)
        expected = one.pullback(q=q[i], z=z[i])
        assert slopes.q0[i] == expected.q0 and slopes.v0[i] == expected.v0 and slopes.z0[i] == expected.z0
        assert all(slopes.parameters[name][i] == expected.parameters[name] for name in ("k", "gamma"))
        assert slopes.t0[i] == expected.t0 and slopes.t_end[i] == expected.t_end and slopes.growth[i] == expected.growth
        expected = one.sensitivity(["x", "k", "gamma"])
        assert all(np.array_equal(getattr(sensitivity, name)[i], getattr(expected, name)) for name in "qvpz")


def test_a_batch_loss():
    loss = hz.ensemble_value_and_grad(lambda t, q, v, z, k, target: k * (q[0] - target) ** 2)
    given = GIVEN | dict(parameters=PARAMETERS | {"target": 0.3})
    values, slopes = loss(L, Q, V, 5.0, **given)
    assert values.shape == (M,) and slopes.q0.shape == (M, 1)
    single = hz.value_and_grad(lambda t, q, v, z, k, target: k * (q[0] - target) ** 2)
    for i in (0, 11):
        value, expected = single(L, Q[i], V[i], 5.0, **GIVEN | dict(parameters={"gamma": -0.1, "k": K[i], "target": 0.3}))
        assert values[i] == value and slopes.v0[i] == expected.v0
        assert all(slopes.parameters[name][i] == expected.parameters[name] for name in ("gamma", "k", "target"))
    # The derivative of the sum in a shared parameter, by central differences of the second order.
    near = [loss(L, Q, V, 5.0, **given | dict(parameters=given["parameters"] | {"gamma": -0.1 + s * 1e-5}))[0].sum() for s in (1, -1)]
    assert abs(slopes.parameters["gamma"].sum() - (near[0] - near[1]) / 2e-5) <= 1e-7 * np.abs(slopes.parameters["gamma"]).sum()


def test_resets_are_those_of_members():
    given = dict(coordinates=["x"], accuracy=1e-9, events=hz.Event("x", "falling", reset={"x'": "-e*x'"}))
    q, e = np.array([[1.0], [0.9], [0.8]]), np.array([0.8, 0.7, 0.6])
    ball, start = "x'^2/2 - 9.81*x", (q, 0 * q, 1.0)
    many = hz.ensemble(ball, *start, parameters={"e": e}, **given)
    values, slopes = hz.ensemble_value_and_grad("x")(ball, *start, parameters={"e": e}, **given)
    pulled, along = many.pullback(q=np.ones((3, 1))), many.sensitivity(["x", "e"])
    assert slopes.troubles == pulled.troubles == along.troubles == {}
    for i in range(3):
        one = hz.solve(ball, q[i], [0.0], 1.0, parameters={"e": e[i]}, **given)
        value, expected = hz.value_and_grad("x")(ball, q[i], [0.0], 1.0, parameters={"e": e[i]}, **given)
        assert values[i] == value == one.q[-1, 0] and slopes.q0[i] == pulled.q0[i] == expected.q0
        assert slopes.parameters["e"][i] == pulled.parameters["e"][i] == expected.parameters["e"]
        # Forward derivatives are those of the adjoint to round-off.
        assert np.allclose(along.q[i, -1, 0], [expected.q0[0], expected.parameters["e"]], rtol=1e-12, atol=0)


def test_momenta_and_no_parameters():
    many = hz.ensemble("x'^2/2 - x^2/2 - z/10", Q, None, 2.0, p0=V, **GIVEN)
    slopes = many.pullback(q=np.ones((M, 1)))
    assert slopes.v0 is None and slopes.p0.shape == (M, 1) and slopes.parameters == {}
    one = hz.solve("x'^2/2 - x^2/2 - z/10", Q[3], None, 2.0, p0=V[3], **GIVEN)
    assert one.pullback(q=[1.0]).p0 == slopes.p0[3]


def test_members_that_fail_have_a_reason():
    q = np.array([[1.0], [0.01], [2.0]])
    given = dict(coordinates=["x"], integrator="gauss_4", steps=10)
    values, slopes = hz.ensemble_value_and_grad("x")("x'^2/2 + 1/x", q, np.zeros((3, 1)), 0.5, **given)
    assert list(slopes.troubles) == [1] and np.isnan(values[1]) and np.isnan(slopes.q0[1]).all()
    assert np.isfinite(values[[0, 2]]).all() and np.isfinite(slopes.q0[[0, 2]]).all()


SAID = {
    "a terminal event": (lambda: ensemble(events=hz.Event("x", terminal=True)).sensitivity("x"), "has a terminal event"),
    "a terminal event of a loss": (
        lambda: hz.ensemble_value_and_grad("x")(L, Q, V, 1.0, parameters=PARAMETERS, events=hz.Event("x", terminal=True), **GIVEN),
        "has a terminal event",
    ),
    "an unknown variable": (lambda: ensemble().sensitivity("kk"), "no variable `kk`"),
    "a number": (lambda: ensemble().sensitivity([1]), "must be a name"),
    "a shape": (lambda: ensemble().pullback(q=np.ones((M, 2))), r"`q` has the shape .*it must be \(20, 2, 1\)"),
    "something infinite": (lambda: ensemble().pullback(z=np.full(M, np.inf)), "`z` is not finite"),
    "a conformal factor": (
        lambda: hz.ensemble_value_and_grad("x*sigma")(L, Q, V, 1.0, parameters=PARAMETERS, **GIVEN),
        "not functions of the final state",
    ),
    "no members": (
        lambda: hz.ensemble_value_and_grad("x")(L, Q[:0], V[:0], 1.0, parameters={"gamma": 0.0, "k": 1.0}, **GIVEN),
        "no members",
    ),
}


def ensemble(**more):
    return hz.ensemble(L, Q, V, 1.0, parameters=PARAMETERS, **GIVEN | more)


@pytest.mark.parametrize("what", SAID)
def test_invalid_input(what):
    call, message = SAID[what]
    with pytest.raises(ValueError, match=f"(?s){message}"):
        call()
