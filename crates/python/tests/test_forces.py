"""Forces and Rayleigh's function: closed forms, all ways to give them, what is lost, and errors."""

import pickle

import herglotz as hz
import numpy as np
import pytest

G, K, T = 9.81, 0.3, 2.0
# The fall from rest with quadratic drag.
DISTANCE = np.log(np.cosh(np.sqrt(G * K) * T)) / K
SPEED = np.sqrt(G / K) * np.tanh(np.sqrt(G * K) * T)


def fall(t, q, v, z):
    return v @ v / 2 + G * q[0]


def drag(t, q, v, z, k):
    return -k * v * np.abs(v)


TEXT = dict(L="x'^2/2 + 9.81*x", coordinates=["x"])
WAYS = {
    "a function": dict(L=fall, force=drag),
    "a function of a number": dict(L=fall, force=lambda t, q, v, z, k: -k * v[0] * abs(v[0])),
    "a function by coordinate": dict(L=fall, force={"q[0]": lambda t, q, v, z, k: -k * v[0] * abs(v[0])}),
    "a text": dict(TEXT, force="-k*x'*abs(x')"),
    "a text by coordinate": dict(TEXT, force={"x": "-k*x'*abs(x')"}),
    "a function for a text": dict(TEXT, force=drag),
    "the text of L": dict(TEXT, L="force[x] = -k*x'*abs(x'); L = x'^2/2 + 9.81*x"),
    "Rayleigh's function": dict(L=fall, rayleigh=lambda t, q, v, z, k: k * np.abs(v[0]) ** 3 / 3),
    "Rayleigh's text": dict(TEXT, rayleigh="k*abs(x')^3/3"),
    "both": dict(TEXT, force="-k*x'*abs(x')/4", rayleigh="k*abs(x')^3/4"),
}


@pytest.mark.parametrize("way", WAYS)
def test_a_fall_with_quadratic_drag(way):
    sol = hz.solve(**WAYS[way], q0=[0.0], v0=[0.0], t=T, accuracy=1e-13, parameters={"k": K})
    assert sol.success, sol.status
    assert abs(sol.q[-1, 0] - DISTANCE) < 1e-12 and abs(sol.v[-1, 0] - SPEED) < 1e-12


def test_a_projectile_with_quadratic_drag():
    def L(t, q, v, z):
        return v @ v / 2 - 9.81 * q[1]

    def force(t, q, v, z, k):
        return -k * np.linalg.norm(v) * v

    given = dict(q0=[0.0, 0.0], v0=[20.0, 15.0], t=np.linspace(0, 2, 5), accuracy=1e-12, parameters={"k": 0.05})
    sol = hz.solve(L, force=force, events=lambda t, q, v, z: q[1], **given)
    same = hz.solve(
        "(x'^2 + y'^2)/2 - 9.81*y",
        coordinates=["x", "y"],
        force={"x": "-k*hypot(x', y')*x'", "y": "-k*hypot(x', y')*y'"},
        **given,
    )
    assert np.allclose(sol.q, same.q, rtol=0, atol=1e-11)
    # The power of the force is the rate of the energy.
    middle = sol([0.999, 1.0, 1.001])
    power = -0.05 * np.linalg.norm(middle.v[1]) * middle.v[1] @ middle.v[1]
    assert (middle.energy[2] - middle.energy[0]) / 0.002 == pytest.approx(power, rel=1e-5)


def test_a_linear_drag_is_the_drag_of_the_action():
    t = np.linspace(0, 10, 11)
    forced = hz.solve("x'^2/2 - x^2/2", [1.0], [0.0], t, coordinates=["x"], force="-0.1*x'", accuracy=1e-12)
    contact = hz.solve("x'^2/2 - x^2/2 - 0.1*z", [1.0], [0.0], t, coordinates=["x"], accuracy=1e-12)
    assert np.allclose(forced.q, contact.q, rtol=0, atol=1e-11)


def test_systems_ensembles_and_motions_that_are_resumed():
    system = hz.system(fall, n=1, force=drag, parameters={"k": K})
    ((coordinate, text),) = system.forces
    assert coordinate == "q[0]" and "abs(" in text
    assert system.used_parameters == ["k"] and "forced" in system.structure
    again = pickle.loads(pickle.dumps(system))
    assert again.forces == system.forces and repr(again) == repr(system)
    sol = hz.solve(again, [0.0], [0.0], T / 2, accuracy=1e-13).resume(T)
    assert abs(sol.q[-1, 0] - DISTANCE) < 1e-12
    # Rayleigh's function in addition to the force of a system, and a parameter that it alone has.
    half = hz.system(fall, n=1, force=drag, parameters={"k": K / 2})
    more = dict(rayleigh=lambda t, q, v, z, c: c * np.abs(v[0]) ** 3 / 3, parameters={"c": K / 2})
    sol = hz.solve(half, [0.0], [0.0], T, **more, accuracy=1e-13)
    assert abs(sol.q[-1, 0] - DISTANCE) < 1e-12
    with pytest.raises(ValueError, match="is given twice; write one sum"):
        hz.solve(system, [0.0], [0.0], T, force=drag)
    k = np.array([0.1, 0.3, 0.5])
    many = hz.ensemble(fall, np.zeros((3, 1)), np.zeros((3, 1)), T, force=drag, accuracy=1e-13, parameters={"k": k})
    assert np.allclose(many.q[:, 0], np.log(np.cosh(np.sqrt(G * k) * T)) / k, rtol=0, atol=2e-12)


def test_what_is_lost():
    motion = dict(L="x'^2/2 - x^2/2", q0=[1.0], v0=[0.0], t=5.0, coordinates=["x"])
    lossless = hz.check(**motion)
    assert lossless and not lossless.losses and lossless.statements
    found = hz.check(**motion, force="-0.1*x'^3")
    assert not found and len(found.losses) == 3
    # The contact defect of a step is the virtual work of the force.
    ((name, _, residual),) = found.statements
    assert "contact defect" in name and residual < 1e-9
    assert "the virtual work of the force" in str(found) and str(found).startswith("not contact")
    plan = str(hz.solve(**motion, force="-0.1*x'^3").plan)
    assert "contact flow: a force f changes eta" in plan and "discrete Lagrangian: there is none" in plan
    assert "contact flow" not in str(hz.solve(**motion).plan)
    compared = hz.compare(**motion, force="-0.1*x'^3")
    assert compared.losses == found.losses and compared.best(1e-6) is not None
    assert "there is a force" in compared.left_out["strang"]


def test_momenta_along_which_the_force_works_are_not_listed():
    given = dict(q0=[1.0, 2.0], v0=[1.0, 1.0], t=1.0, coordinates=["x", "y"])
    assert list(hz.solve("(x'^2 + y'^2)/2", **given).momenta)
    found = hz.solve("(x'^2 + y'^2)/2", force={"x": "-x'"}, **given).momenta
    assert list(found) == ["translation of y"]


def test_gauss_collocation_and_the_exact_flow_have_no_discrete_lagrangian_with_forces():
    system = hz.system("x'^2/2", ["x"], force="-x'")
    with pytest.raises(ValueError, match='no discrete Lagrangian with forces; choose a rule such as "midpoint"'):
        hz.path(system, [0.0], [1.0], 1.0, steps=10)
    with pytest.raises(ValueError, match="force"):
        hz.exact_lagrangian(system, 0.1, [0.0], [0.1])


PLANE = dict(L="(x'^2 + y'^2)/2", q0=[0.0, 0.0], v0=[1.0, 1.0], t=1.0, coordinates=["x", "y"])
WRONG = {
    "one text for two": (PLANE | dict(force="-x'"), r"`force` is one formula, but there are 2 coordinates.*\{'x': "),
    "an unknown coordinate": (PLANE | dict(force={"w": "-x'"}), "the force on \"w\".*w"),
    "an unknown name": (PLANE | dict(force={"x": "-c*x'"}), "the force on \"x\": line 1, column 2: unknown name `c`"),
    "a number": (PLANE | dict(force=3.0), "`force` is 3.0; it must be a function"),
    "a list in a dict": (PLANE | dict(force={"x": [1.0]}), r"`force\['x'\]` is \[1.0\]; it must be a formula"),
    "a number of two": (
        PLANE | dict(force=lambda t, q, v, z: -v[0]),
        r"returns .* as a force, but there are 2 coordinates: return an array of shape \(2,\)",
    ),
    "too many": (PLANE | dict(force=lambda t, q, v, z: [1.0, 2.0, 3.0]), r"an array of shape \(3,\) as a force"),
    "nothing": (PLANE | dict(force=lambda t, q, v, z: None), "returns None as a force"),
    "no value": (PLANE | dict(force=lambda t, q, v, z, c: -c * v), "the parameter 'c' of <lambda> has no value"),
    "a parameter that is not used": (
        PLANE | dict(force=lambda t, q, v, z, c=1.0: -c * v, parameters={"d": 1.0}),
        "the parameter 'd' is not used in the Lagrangian, a force",
    ),
    "twice": (PLANE | dict(L="force[x] = 1; L = (x'^2 + y'^2)/2", force={"x": "2"}), "the force on `x` is given twice"),
    "a wrong Rayleigh function": (PLANE | dict(rayleigh="x'^2 +"), "`rayleigh`: line 1"),
    "a list as Rayleigh's function": (PLANE | dict(rayleigh=[1.0]), r"`rayleigh` is \[1.0\]; it must be a formula"),
    "a splitting": (PLANE | dict(force={"x": "-z*x'"}, integrator="strang", step=0.1), "there is a force.*gauss_4"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_forces(case):
    request, message = WRONG[case]
    with pytest.raises(ValueError, match=message):
        hz.solve(**request)
