"""Lattices, bodies and rigid bodies as systems for `solve` and for the other functions."""

import pickle

import herglotz as hz
import numpy as np
import pytest

SITE, BOND = "x'^2/2 - (1 - cos(x)) + gamma*z", "-k*(xr - xl)^2/2"
GIVEN = {"k": 2.0, "gamma": -0.1}


def chain(sites, **more):
    return hz.lattice(SITE, BOND, sites=sites, parameters=GIVEN, **more)


def waves(*shape):
    return np.sin(1.3 * np.arange(np.prod(shape))).reshape(shape)


def test_a_long_lattice_runs_by_its_sparse_integrators():
    t, q0 = np.linspace(0, 2, 5), waves(30)
    for integrator in ("strang", "gauss_2"):
        steps = dict(integrator=integrator, step=0.05)
        sol = hz.solve(chain(30), q0, 0.0, t, **steps)
        short = hz.lattice(SITE, BOND, q0, 0.0, t, parameters=GIVEN, **steps)
        assert type(sol) is hz.SparseSolution and (sol.q == short.q).all() and (sol.z == short.z).all()
    # With events it is a formula, which runs by the same collocation: round-off of forty steps.
    seen = hz.solve(chain(30), q0, 0.0, t, events="x[0] - 0.01", **steps)
    assert type(seen) is hz.Solution and abs(seen.q - sol.q).max() < 1e-12 and len(seen.events[0])


@pytest.mark.parametrize("boundary", ["periodic", "fixed", "free"])
def test_a_short_lattice_is_the_formula_that_one_would_write(boundary):
    ends = {"periodic": "(x[0] - x[3])^2", "fixed": "x[0]^2 + x[3]^2", "free": "0"}[boundary]
    written = f"sum(i, 0, 3, x'[i]^2/2 - (1 - cos(x[i]))) - k*(sum(i, 1, 3, (x[i] - x[i-1])^2) + {ends})/2 + gamma*z"
    start = waves(4), [0.1, 0.0, -0.1, 0.2], 10.0
    sol = hz.solve(chain(4, boundary=boundary), *start, accuracy=1e-10)
    expected = hz.solve(written, *start, coordinates=["x[4]"], parameters=GIVEN, accuracy=1e-10)
    # Ten times the accuracy; the derivatives are those of different steps.
    assert abs(sol.q - expected.q).max() < 1e-9
    found = sol.sensitivity(["k"]).q, expected.sensitivity(["k"]).q
    assert abs(found[0] - found[1]).max() < 1e-7
    assert hz.check(chain(4, boundary=boundary), *start, integrator="gauss_4", step=0.1).is_contact


def test_several_directions_and_components_are_in_the_order_of_the_start():
    lattice = hz.lattice("(x'^2 + y'^2)/2 - x^4 - y^2 + gamma*z", "-(xr - xl)^2 - (yr - yl)^2/2", sites=(2, 3), coordinates=["x", "y"], parameters={"gamma": -0.1})
    # Rows at the ends of steps: within them those of a formula are on polynomials.
    q0, t = waves(2, 3, 2), np.linspace(0, 2, 5)
    assert (lattice.shape, lattice.dimension) == ((2, 3, 2), 12)
    sol = hz.solve(lattice, q0, 0.0, t, integrator="gauss_2", step=0.05)
    short = hz.lattice("(x'^2 + y'^2)/2 - x^4 - y^2 + gamma*z", "-(xr - xl)^2 - (yr - yl)^2/2", q0, 0.0, t, coordinates=["x", "y"], parameters={"gamma": -0.1}, integrator="gauss_2", step=0.05)
    assert abs(sol.q - short.q.reshape(5, 12)).max() < 1e-12
    assert (sol["y_5"] == sol.q[:, 11]).all()


def test_masses_of_bodies_are_parameters():
    pair = hz.bodies([1.0, 0.5], dimensions=2, gamma=-0.1)
    q0, v0 = [[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]]
    t = np.linspace(0, 2, 9)
    sol = hz.solve(pair, q0, v0, t, accuracy=1e-10)
    short = hz.bodies([1.0, 0.5], q0, v0, t, gamma=-0.1, step=0.002)
    # Ten times the accuracy; the error of 1000 steps of order 6 is below it.
    assert abs(sol.q - short.q.reshape(9, 4)).max() < 1e-9
    # The mass of a body from the path of the other.
    found = hz.fit(pair, np.ravel(q0), np.ravel(v0), t[1:], {"x_1": sol["x_1"][1:]}, ["m_0"], t0=0.0, parameters={"m_0": 1.1})
    assert abs(found["m_0"] - 1.0) < 1e-6
    other = hz.solve(pair, q0, v0, 2.0, parameters={"m_1": 0.25})
    assert other.system.parameters["m_1"] == 0.25


def test_systems_are_pickled_and_shown():
    for system in (chain(4), hz.bodies([1.0, 0.5], dimensions=3)):
        again = pickle.loads(pickle.dumps(system))
        assert repr(again) == repr(system) and again.system.lagrangian == system.system.lagrangian
    body = pickle.loads(pickle.dumps(hz.body((1, 2, 3))))
    assert repr(body) == "<RigidBody: inertia [1, 2, 3]>"


def test_a_rigid_body_is_solved_checked_and_continued():
    body = hz.body((1, 2, 3), gamma=-0.1)
    omega, t = [1.0, 0.5, 0.25], np.linspace(0, 4, 9)
    sol = hz.solve(body, v0=omega, t=t, accuracy=1e-10)
    same = hz.rigid_body((1, 2, 3), gamma=-0.1, omega=omega, t=t, accuracy=1e-10)
    assert (sol.omega == same.omega).all() and (sol.attitude == same.attitude).all()
    by_momentum = hz.solve(body, p0=np.array([1, 2, 3]) * omega, t=t, accuracy=1e-10)
    # The start differs by the round-off of a linear system.
    assert abs(by_momentum.omega - sol.omega).max() < 1e-14
    # Also with other values of the body: the inertia about the fixed point is that of these.
    heavy = dict(mass=2.0, centre=(0.0, 0.1, 0.2))
    by_momentum = hz.solve(body, p0=np.array([1, 2, 3]) * omega, t=t, parameters=heavy)
    assert abs(by_momentum.Pi[0] - np.array([1, 2, 3]) * omega).max() < 1e-15
    # The plan is that of the run, and a state between rows is that of a run that ends there.
    assert (sol.plan.steps, sol.plan.integrator) == (sol.steps, sol.integrator) and "trial runs" in str(sol.plan)
    between, end = sol([0.3, 1.7]), hz.solve(body, v0=omega, t=[0, 1.7], accuracy=1e-12).end
    assert between.t.tolist() == [0.3, 1.7] and abs(between.omega[1] - end.omega[0]).max() < 1e-9
    # A motion that ends at an event within a step has the same steps again.
    ended = dict(v0=omega, t=[0, 4], integrator="gauss_2", step=0.3)
    first = hz.solve(body, **ended, events=hz.Event("omega2 - 0.3", terminal=True))
    assert 0 < first.t_end < 4 and abs(first(first.t_end).omega - first.end.omega).max() == 0
    at = 0.9 * first.t_end
    assert (first(at).omega == hz.solve(body, **ended)(at).omega).all()
    with pytest.raises(ValueError, match="is not in the motion"):
        sol(4.5)
    # In two parts, of the same steps: round-off of the attitude and of the velocity between them.
    first = hz.solve(body, v0=omega, t=[0, 2], integrator="gauss_4", step=0.05)
    whole = hz.solve(body, v0=omega, t=[0, 2, 4], integrator="gauss_4", step=0.05)
    assert abs(first.resume(4.0).omega[-1] - whole.omega[-1]).max() < 1e-13
    with pytest.raises(ValueError, match="give a later `t`"):
        first.resume()
    assert hz.check(body, v0=omega, t=1.0, integrator="gauss_4", step=0.05).is_contact
    assert [sol.success for sol in hz.ensemble(body, v0=[omega, omega], t=1.0)] == [True, True]


def test_the_shortest_turn_between_attitudes():
    from herglotz._body import _turn

    def turned(axis, angle):
        return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * np.array(axis, dtype=float))])

    for sign in (1.0, -1.0):
        assert abs(_turn(turned([1, 0, 0], 0.4), sign * turned([1, 0, 0], 1.6)) - [1.2, 0, 0]).max() < 1e-15
        # Beyond half a turn the other way is shorter.
        assert abs(_turn(turned([0, 0, 1], 0.0), sign * turned([0, 0, 1], 4.0)) - [0, 0, 4.0 - 2 * np.pi]).max() < 1e-15
    assert (_turn(turned([0, 1, 0], 0.3), turned([0, 1, 0], 0.3)) == 0).all()


def test_a_path_of_a_rigid_body_joins_two_attitudes():
    turned = np.array([np.cos(0.6), 0.0, np.sin(0.6), 0.0])
    # The same attitude with the other sign: the shortest turn.
    for to in (turned, -turned):
        sol = hz.path(hz.body((1, 2, 3), gamma=-0.1), (1.0, 0.0, 0.0, 0.0), to, 2.0, steps=40)
        # About a principal axis it turns as omega e^(gamma t), by 1.2 in all.
        assert abs(abs(sol.attitude[-1] @ turned) - 1) < 1e-12 and abs(sol.omega[0] - [0, 0.12 / (1 - np.exp(-0.2)), 0]).max() < 1e-9


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda: hz.lattice(SITE, BOND), "`q0` is not given: give `q0` for a motion here, or `sites`"),
        (lambda: hz.lattice(SITE, BOND, sites=4, t=1.0), "`t` is given without `q0`"),
        (lambda: hz.bodies([1, 2]), "`q0` is not given: give `q0` for a motion here, or `dimensions`"),
        (lambda: hz.solve(chain(4), waves(3), [0.0] * 3, 1.0), "broadcast|has 3 numbers"),
        (lambda: hz.solve(chain(4), waves(4), 0.0, 1.0, parameters={"kk": 1.0}), "kk"),
        (lambda: hz.solve(chain(300), waves(300), 0.0, 1.0), "a formula has at most 256 coordinates, and the lattice has 300"),
        (lambda: hz.solve(chain(300), waves(300), 0.0, 1.0, integrator="strang", step=0.1, events="x[0]"), "at most 256"),
        (lambda: hz.lattice("force[x] = -x'\n" + SITE, BOND, waves(4), 0.0, 1.0, step=0.1, parameters=GIVEN), "`site` has a force"),
        (lambda: hz.solve(hz.lattice("x'^2/2 - q[0]^2", sites=4), waves(4), 0.0, 1.0), "`site` uses `q`"),
        (lambda: hz.solve(hz.body((1, 2, 3)), t=1.0), "give either `v0`, the angular velocity"),
        (lambda: hz.solve(hz.body((1, 2, 3)), v0=[1, 0, 0], t=1.0, observe={"a": "z"}), "`observe` is not there for rigid bodies"),
        (lambda: hz.fit(hz.body((1, 2, 3)), v0=[1, 0, 0], t=[1.0], data={"x": [1.0]}, unknowns=["mass"], t0=0.0), "a rigid body is not a formula"),
        (lambda: hz.solve(hz.body((1, 2, 3)), v0=[1, 0, 0], t=1.0, parameters={"masses": 1}), "masses"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(call, message):
    with pytest.raises(ValueError, match=message):
        call()
