"""Discrete Lagrangians of the user as integrators."""

import pickle

import herglotz as hz
import numpy as np
import pytest


def midpoint(L, t, q0, q1, z0, h):
    return h * L(t + h / 2, (q0 + q1) / 2, (q1 - q0) / h, z0)


def verlet(L, t, q0, q1, z0, h):
    v = (q1 - q0) / h
    return h / 2 * (L(t, q0, v, z0) + L(t + h, q1, v, z0))


GIVEN = dict(L="x'^2/2 + cos(x) + gamma*z", q0=[1.0], v0=[0.2], coordinates=["x"], parameters={"gamma": -0.1})


def test_a_method_has_its_order():
    exact = hz.solve(**GIVEN, t=4.0, accuracy=1e-13).q[-1]
    for method, order, L in ((midpoint, 1, None), (verlet, 2, "x'^2/2 + cos(x)")):
        given = GIVEN if L is None else GIVEN | dict(L=L, parameters=None)
        end = exact if L is None else hz.solve(**given, t=4.0, accuracy=1e-13).q[-1]
        own = hz.method(method, order, symmetric=order == 2)
        errors = [np.abs(hz.solve(**given, t=4.0, integrator=own, steps=n).q[-1] - end).max() for n in (200, 400)]
        assert abs(np.log2(errors[0] / errors[1]) - order) < 0.15


def test_the_steps_are_contact_and_the_theorems_hold():
    own = hz.method(midpoint, 1)
    found = hz.check(**GIVEN, t=4.0, integrator=own, steps=40)
    assert found.is_contact and found.integrator == "midpoint"
    assert max(place.contact_defect for place in found.places) < 1e-9
    assert len(found.statements) > 10 and all(method == "midpoint" and residual < 1e-8 for _, method, residual in found.statements)


def test_in_three_coordinates_with_events_rows_and_derivatives_in_the_start():
    def L(t, q, v, z, k):
        return v @ v / 2 - k * np.cos(q[0] - q[1]) - q @ q / 2 - z * np.sin(t) / 10 + q[2] * v[0] / 5

    own = hz.method(lambda L, t, q0, q1, z0, h, k: h * L(t + h / 2, (q0 + q1) / 2, (q1 - q0) / h, z0 + 0 * k), 2, name="mine")
    given = dict(L=L, q0=[0.3, -0.2, 0.5], v0=[0.1, 0.4, 0.0], parameters={"k": 0.7})
    sol = hz.solve(**given, t=np.linspace(0, 3, 7), integrator=own, step=0.01, events="x0 - x1" if False else "q[0] - q[1]")
    assert sol.success and sol.plan.integrator == "mine" and len(sol.events) == 1
    near = hz.solve(**given, t=np.linspace(0, 3, 7), integrator="gauss_4", step=0.05)
    assert np.abs(sol.q - near.q).max() < 1e-2
    d = 1e-5
    moved = [hz.solve(**given | dict(q0=[0.3 + s, -0.2, 0.5]), t=3.0, integrator=own, step=0.01).q[-1] for s in (d, -d)]
    slopes = hz.solve(**given, t=3.0, integrator=own, step=0.01).sensitivity("q[0]").q[-1]
    assert np.allclose(slopes, (moved[0] - moved[1]) / (2 * d), atol=1e-6)
    with pytest.raises(ValueError, match="mine"):
        sol.sensitivity("k")


def test_an_accuracy_by_a_method():
    own = hz.method(midpoint, 1)
    sol = hz.solve(**GIVEN, t=1.0, integrator=own, accuracy=1e-4)
    exact = hz.solve(**GIVEN, t=1.0, accuracy=1e-12)
    assert np.abs(sol.q[-1] - exact.q[-1]).max() < 1e-4


def test_it_resumes_and_is_pickled():
    own = hz.method(midpoint, 1)
    sol = hz.solve(**GIVEN, t=[0.0, 1.0], integrator=own, step=0.1)
    other = pickle.loads(pickle.dumps(sol))
    assert np.array_equal(other.resume(2.0).q, sol.resume(2.0).q)


def test_it_is_compared():
    found = hz.compare(**GIVEN, t=1.0, method=hz.method(midpoint, 1, name="mine"))
    mine = [row for row in found.rows if row.integrator == "mine"]
    assert len(mine) >= 5 and all(row.order == 1 for row in mine)


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda: hz.method(3, 2), "`function` is 3"),
        (lambda: hz.method(midpoint, 0), "`order` is 0"),
        (lambda: hz.method(midpoint, 1.5), "`order` is 1.5"),
        (lambda: hz.method(midpoint, 1, name=3), "`name` is 3"),
        (lambda: hz.solve(H="p_x^2/2", q0=[1.0], p0=[0.0], t=1.0, coordinates=["x"], integrator=hz.method(midpoint, 1), step=0.1), "takes no Hamiltonian"),
        (lambda: hz.solve(**GIVEN, t=1.0, force={"x": "-x'"}, integrator=hz.method(midpoint, 1), step=0.1), "without forces, constraints and resets"),
        (lambda: hz.solve(**GIVEN, t=1.0, integrator=hz.method(lambda L, t, q0, q1, z0, h: h * L(t, q0, q1), 1), step=0.1), "missing 1 required"),
        (lambda: hz.solve(**GIVEN, t=1.0, integrator=hz.method(lambda L, t, q0, q1, z0, h: h * L(t, q0, [1.0, 2.0], z0), 1), step=0.1), "2 numbers as v"),
        (lambda: hz.solve(**GIVEN, t=1.0, integrator=hz.method(lambda L, t, q0, q1, z0, h: q0[0], 1, name="mine"), step=0.1), "not regular"),
        (lambda: hz.ensemble(GIVEN["L"], [[1.0]], [[0.0]], 1.0, coordinates=["x"], parameters={"gamma": -0.1}, integrator=hz.method(midpoint, 1), step=0.1), "integrator"),
    ],
)  # fmt: skip
def test_what_is_refused(call, message):
    with pytest.raises((ValueError, TypeError), match=message):
        call()
