"""Every public function and method passes on, or refuses, each of its arguments.

For each parameter there is a value that must change the result, or must be refused: a parameter without one fails, and so
does one that has no effect.
"""

import importlib
import inspect
from pathlib import Path
from typing import NamedTuple

import herglotz as hz
import numpy as np
import pytest

SCENES = Path(__file__).parents[3] / "scenes"
L, COORDINATES = "x'^2/2 - k*x^2/2 + gamma*z", ["x"]
PARAMETERS = {"k": 1.0, "gamma": -0.1}
DRIVE = hz.table([0.0, 0.4, 1.0], [0.0, 1.0, -1.0])
BALL = hz.Event("x", "falling", reset={"x'": "-x'/2"})
PENDULUM = dict(L="(x'^2 + y'^2)/2 - 9.81*y", q0=[0.6, -0.8], v0=[0.8, 0.6], coordinates=["x", "y"], parameters=None)
TABLES = dict(L="x'^2/2 + x*drive(t)", parameters=None)
FORCE = {"x": "-x'*abs(x')"}


def parameters(of):
    kinds = inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD
    return [x.name for x in inspect.signature(of).parameters.values() if x.kind not in kinds and x.name != "self"]


class Changed(NamedTuple):
    """A value with which the result is another one, beside other arguments that both calls have."""

    value: object
    beside: dict = {}


class Refused(NamedTuple):
    """A value that is refused with a message."""

    value: object
    message: str
    beside: dict = {}


# The arguments of a motion that most functions take.
STEPS = dict(integrator="gauss_2", step=0.1)
GIVEN = dict(L=L, q0=[1.0], v0=[0.5], t=[0.0, 0.4, 1.0], coordinates=COORDINATES, parameters=PARAMETERS)
MOTION = dict(
    L="x'^2/2 - k*x^4/4 + gamma*z",
    q0=[1.1],
    v0=[0.6],
    t=[0.0, 0.4, 1.1],
    p0=Changed([0.7], dict(v0=None, p0=[0.5])),
    z0=Changed(0.7, dict(L="x'^2/2 - x^2/2 - z^2/10", parameters=None)),
    accuracy=Changed(1e-3, dict(t=50.0)),
    integrator=Changed("gauss_2", dict(integrator="gauss_3", step=0.1)),
    step=Changed(0.2, STEPS),
    steps=Changed(5, dict(integrator="gauss_2", steps=10)),
    scales=Refused([-1.0], "scale of coordinate 0"),
    coordinates=Refused(["y"], "unknown name `x`"),
    parameters={"k": 2.0, "gamma": -0.1},
    force=FORCE,
    rayleigh="x'^4/4",
    tables=Changed({"drive": hz.table([0.0, 1.0], [0.0, 5.0])}, TABLES | dict(tables={"drive": DRIVE})),
    breaks=Changed([0.35], dict(integrator="gauss_1", step=0.5)),
)
HAMILTONIAN = dict(L=None, H="p_x^2/2 + x^2/2 + z/10", v0=None, p0=[0.5], parameters=None)
ROWS = dict(
    H=Changed("p_x^2/2 + x^2", HAMILTONIAN),
    every=Changed(2, STEPS),
    events="x - 0.9",
    observe={"square": "x^2"},
    conformal_factor=True,
    estimate=Changed(True, STEPS),
    exact=Changed(True, dict(integrator="gauss_1", step=0.5)),
    momenta=Refused(["p"], "unknown name `p_x`", HAMILTONIAN),
    action=Refused("s", "unknown name `z`"),
    constraints=Changed("x^2 + y^2 = 1", PENDULUM),
    friction={"x": 0.2},
    project=Refused(True, "the system has no constraints"),
)
WATCH = dict(
    progress=Refused("yes", "`progress` is 'yes'"),
    callback=Refused(5, "`callback` is 5"),
    callback_interval=Refused(-1.0, "`callback_interval` is -1.0"),
)
SOLVE = MOTION | ROWS | WATCH
# What belongs to the system beside its Lagrangian.
OF_SYSTEM = {name: ROWS[name] for name in ("H", "momenta", "action", "constraints", "friction")}
# What a loss or a differentiable motion has no use for.
NO_ROWS = {
    name: Refused(value, f"`{name}` cannot be given here")
    for name, value in dict(observe={"square": "x^2"}, every=2, conformal_factor=True, estimate=True, exact=True, progress=True, callback=print).items()
}
RESET = dict(t=3.0, parameters={"k": 1.0, "gamma": -0.1})
LOSS = SOLVE | NO_ROWS | dict(events=Changed(BALL, RESET))
LOSS["t"] = [0.0, 1.1]

MANY = dict(GIVEN, q0=[[1.0], [0.5]], v0=[[0.5], [0.0]])
ENSEMBLE = {name: of for name, of in MOTION.items() if name != "scales"} | dict(
    q0=[[1.1], [0.5]],
    v0=[[0.6], [0.0]],
    p0=Changed([[0.7], [0.0]], dict(v0=None, p0=[[0.5], [0.0]])),
    z0=Changed([0.0, 0.7], dict(L="x'^2/2 - x^2/2 - z^2/10", parameters=None)),
    accuracy=Changed(1e-3, dict(t=[0.0, 20.0, 50.0])),
    events="x - 0.9",
    observe={"square": "x^2"},
    threads=Refused(0, "`threads` is 0"),
    progress=WATCH["progress"],
    **OF_SYSTEM | dict(
        H=Changed("p_x^2/2 + x^2", HAMILTONIAN | dict(p0=[[0.5], [0.0]])),
        momenta=Refused(["p"], "unknown name `p_x`", HAMILTONIAN | dict(p0=[[0.5], [0.0]])),
        constraints=Changed("x^2 + y^2 = 1", PENDULUM | dict(q0=[PENDULUM["q0"]], v0=[PENDULUM["v0"]])),
    ),
)
TIMES = np.linspace(0.0, 3.0, 7)
DATA = {"x": np.cos(TIMES) + 0.01 * np.sin(9.0 * TIMES)}
FITTED = dict(GIVEN, t=TIMES, data=DATA, unknowns=["k"])
FIT = MOTION | dict(
    t=Refused(TIMES[:3], "has 7 values, but `t` has 3"),
    data={"x": np.cos(1.1 * TIMES)},
    unknowns=["gamma"],
    force={"x": "-x'/4"},
    t0=-0.5,
    sigma=0.01,
    bounds={"k": (1.0, 1.2)},
    loss=Changed(("huber", 0.001)),
    nodes=[1.5],
    starts=[{"k": 0.5}, {"k": 3.0}],
    max_evaluations=1,
    absolute_sigma=Changed(True, dict(sigma=0.5)),
    tables=Changed(
        {"drive": hz.table([0.0, 1.0], [0.0, 5.0])}, dict(L="x'^2/2 + k*x*drive(t)", parameters={"k": 1.0}, tables={"drive": DRIVE})
    ),
    z0=Changed(0.7, dict(L="x'^2/2 - k*x^2/2 - z^2/10", parameters={"k": 1.0})),
    accuracy=Refused(-1.0, "error is -1; it must be positive"),
    events={"level": ("x - 0.5", [1.05])},
    H=Changed("p_x^2/2 + k*x^2/2 + z/10", HAMILTONIAN | dict(H="p_x^2/2 + k*x^2/2 + z/5", parameters={"k": 1.0})),
    momenta=Refused(["p"], "unknown name `p_x`", HAMILTONIAN),
    action=OF_SYSTEM["action"],
    friction={"x": 0.05},
    constraints=Changed("x^2 + y^2 = 1", PENDULUM | dict(L="(x'^2 + y'^2)/2 - k*y", parameters={"k": 9.81})),
    project=Refused(True, "the system has no constraints"),
)
EXACT = dict(L=L, h=0.3, q0=[1.0], coordinates=COORDINATES, parameters=PARAMETERS)
OF_EXACT = dict(
    L="x'^2/2 - x^4 + k*gamma*z", h=0.4, q0=[1.1], z0=Changed(0.5, dict(L="x'^2/2 - z^2", parameters=None)),
    t=Changed(0.5, dict(L="x'^2/2 - t*x^2", parameters=None)), coordinates=Refused(["y"], "unknown name"),
    parameters={"k": 2.0, "gamma": -0.1},
)  # fmt: skip
LATTICE = dict(site="x'^2/2 + k*cos(x) + gamma*z", bond="-(xr - xl)^2/2", q0=[0.1, 0.3, 0.0, 0.2], v0=0.0, t=1.0, step=0.1,
               parameters=PARAMETERS)  # fmt: skip
BODIES = dict(masses=[1.0, 0.5], q0=[[0.0, 0.0], [1.0, 0.0]], v0=[[0.0, 0.0], [0.0, 1.0]], t=1.0, step=0.1)
NO_START = dict(q0=None, v0=None, t=None, step=None)
OF_MANY = dict(
    q0=[0.2, 0.3, 0.0, 0.2],
    v0=0.1,
    t=2.0,
    p0=Changed(0.5, dict(v0=None, p0=0.1)),
    z0=0.5,
    integrator="midpoint",
    step=0.05,
    steps=Changed(7, dict(step=None, steps=8)),
    every=2,
    conformal_factor=True,
    **WATCH,
)
BODY = dict(inertia=(1, 2, 3), omega=(1.0, 0.5, 0.25), t=1.0, mass=1.0, centre=(0.0, 0.1, 0.2), gravity=(0.0, 0.0, -1.0), gamma=-0.1)
TURNED = (np.cos(0.1), np.sin(0.1), 0.0, 0.0)
OF_BODY = dict(
    inertia=(1, 2, 2.5),
    mass=0.5,
    centre=(0.0, 0.1, 0.3),
    gravity=(0.0, 0.0, -2.0),
    gamma=-0.2,
    torque=Changed(("0.1", "0", "0"), dict(integrator="gauss_4", step=0.1)),
    attitude=TURNED,
    omega=(1.0, 0.5, 0.3),
    z0=0.5,
    t=1.5,
    accuracy=Changed(1e-3, dict(t=30.0)),
    integrator="gauss_4",
    step=Changed(0.05, dict(integrator="gauss_4", step=0.1)),
    steps=Changed(20, dict(integrator="gauss_4", steps=10)),
)
BETWEEN = BODY | dict(to=(np.cos(0.4), np.sin(0.4), 0.0, 0.0), omega=(0.8, 0.0, 0.0))


def contact_map(q, p, z):
    return 2 * q, p, 2 * z


def trapezoidal(L, t, q0, q1, z0, h):
    v = (q1 - q0) / h
    return h * (L(t, q0, v, z0) + L(t + h, q1, v, z0)) / 2


def twice(L, t, q0, q1, z0, h):
    return h * L(t + h / 2, (q0 + q1) / 2, (q1 - q0) / h, z0)


def run_by(function, order, name=None, symmetric=False):
    """A motion by a method of one's own, with the properties of the method."""
    method = hz.method(function, order, name=name, symmetric=symmetric)
    return method.name, method.order, method.symmetric, hz.solve(**GIVEN, integrator=method, step=0.1).q


# The arguments of a call of each function, and for each parameter what changes the result or is refused.
CASES = {
    "solve": (hz.solve, GIVEN, SOLVE),
    "value_and_grad": (hz.value_and_grad("x + x'"), GIVEN | dict(t=1.0), LOSS),
    "value_and_grad()": (lambda loss: hz.value_and_grad(loss)(**GIVEN), dict(loss="x"), dict(loss="x^2")),
    "ensemble": (hz.ensemble, MANY, ENSEMBLE),
    "ensemble_value_and_grad": (
        hz.ensemble_value_and_grad("x + x'"),
        MANY | dict(t=1.0),
        ENSEMBLE
        | dict(
            H=Refused("p_x^2/2 + x^2", "not computed for a Hamiltonian", HAMILTONIAN | dict(p0=[[0.5], [0.0]])),
            constraints=Refused("x^2 + y^2 = 1", "not computed with constraints", PENDULUM | dict(q0=[PENDULUM["q0"]], v0=[PENDULUM["v0"]])),
        )
        | dict(t=1.1, observe=NO_ROWS["observe"], progress=NO_ROWS["progress"], events=Changed(BALL, RESET), accuracy=Changed(1e-3, dict(t=50.0))),
    ),
    "ensemble_value_and_grad()": (lambda loss: hz.ensemble_value_and_grad(loss)(**MANY), dict(loss="x"), dict(loss="x^2")),
    "system": (
        hz.system,
        dict(L=L, coordinates=COORDINATES, parameters=PARAMETERS),
        {name: MOTION[name] for name in ("L", "force", "rayleigh", "tables", "parameters")}
        | dict(
            coordinates=["x", "y"],
            H=Changed("p_x^2/2 + x^2", dict(L=None, H="p_x^2/2", parameters=None)),
            momenta=Refused(["p"], "unknown name `p_x`", dict(L=None, H="p_x^2/2", parameters=None)),
            action=Refused("s", "unknown name `z`"),
            n=Refused(2, "`n` is 2, but the system has 1 coordinates"),
            breaks=[0.5],
            constraints=Changed("x = y", dict(coordinates=["x", "y"])),
            friction={"x": 0.2},
        ),
    ),
    "table": (hz.table, dict(t=[0.0, 1.0, 2.0], y=[0.0, 1.0, 0.0]), dict(t=[0.0, 1.5, 2.0], y=[0.0, 2.0, 0.0], pieces="cubic")),
    "fit": (hz.fit, FITTED, FIT),
    "path": (
        hz.path,
        dict(GIVEN, t=1.0, q1=[0.5], steps=8) | {"v0": None},
        {name: MOTION[name] for name in ("L", "q0", "z0", "coordinates", "parameters")}
        | dict(
            q1=[0.6],
            t=(0.5, 2.0),
            steps=9,
            integrator="midpoint",
            guess=Refused([[0.0]], "points of the path is 1"),
            force=Changed(FORCE, dict(integrator="midpoint")),
            rayleigh=Changed("x'^4/4", dict(integrator="midpoint")),
            tables=MOTION["tables"],
        ),
    ),
    "geometry": (
        hz.geometry,
        dict(L=L, t=0.5, q=[1.0], v=[0.5], coordinates=COORDINATES, parameters=PARAMETERS),
        dict(
            L="x'^2 + k*gamma*z", t=Changed(1.0, dict(L="t*x'^2", parameters=None)), q=[1.1], v=[0.6], z=0.4,
            H=Changed("p_x^2", dict(L=None, H="p_x^2/2", v=None, p=[1.0], parameters=None)),
            p=Changed([1.1], dict(L=None, H="p_x^2/2", v=None, p=[1.0], parameters=None)),
            coordinates=Refused(["y"], "unknown name"), parameters={"k": 2.0, "gamma": -0.1},
            momenta=Refused(["p"], "unknown name `p_x`", dict(L=None, H="p_x^2/2", v=None, p=[1.0], parameters=None)),
            action=Refused("s", "unknown name `z`"),
        ),
    ),
    "is_contact": (
        hz.is_contact,
        dict(map=contact_map, at=([1.0], [0.5], 0.0)),
        dict(map=lambda q, p, z: (2 * q, 2 * p, z), at=([2.0], [0.5], 0.0), tolerance=Changed(10.0, dict(map=lambda q, p, z: (2 * q, 3 * p, z)))),
    ),
    "check": (
        hz.check,
        GIVEN | dict(t=1.0),
        {name: of for name, of in (MOTION | OF_SYSTEM).items() if name != "scales"}
        | dict(t=1.1, places=Changed(3, STEPS), events=Changed(BALL, RESET | dict(integrator="gauss_2", step=0.1))),
    ),
    "compare": (
        hz.compare,
        dict(GIVEN, t=0.2),
        {name: MOTION[name] for name in ("q0", "v0", "p0", "z0", "coordinates", "parameters", "rayleigh", "tables", "force")}
        | OF_SYSTEM
        | dict(
            L="x'^2/2 - k*x^2/2 + gamma*z/2", t=0.3, breaks=[0.1], method=hz.method(trapezoidal, 1),
            friction={"x": 0.2},
        ),
    ),
    "method": (run_by, dict(function=trapezoidal, order=1), dict(function=twice, order=2, name="other", symmetric=True)),
    "exponential": (hz.exponential, EXACT | dict(v0=[0.5]), OF_EXACT | dict(v0=[0.6])),
    "retract": (hz.retract, EXACT | dict(q1=[1.1]), OF_EXACT | dict(q1=[1.2])),
    "exact_lagrangian": (hz.exact_lagrangian, EXACT | dict(q1=[1.1]), OF_EXACT | dict(q1=[1.2])),
    "lattice": (
        hz.lattice,
        LATTICE,
        OF_MANY
        | dict(
            site="x'^2/2 + 2*k*cos(x) + gamma*z", bond="-(xr - xl)^2", boundary="fixed", coordinates=Refused(["y"], "unknown name"),
            parameters={"k": 2.0, "gamma": -0.1}, sites=Changed(5, NO_START | dict(sites=4)),
        ),
    ),
    "bodies": (
        hz.bodies,
        BODIES,
        OF_MANY
        | dict(masses=[1.0, 0.6], q0=[[0.0, 0.1], [1.0, 0.0]], G=2.0, gamma=-0.1, integrator="strang", p0=Changed(0.5, dict(v0=None, p0=0.1)), dimensions=Changed(3, NO_START | dict(dimensions=2))),
    ),
    "body": (
        lambda **given: hz.solve(hz.body(**given), v0=BODY["omega"], t=1.0, integrator="gauss_4", step=0.1),
        {name: x for name, x in BODY.items() if name not in ("omega", "t")},
        {name: OF_BODY[name] for name in ("inertia", "mass", "centre", "gravity", "gamma")} | dict(torque=("0.1", "0", "0")),
    ),
    "rigid_body": (hz.rigid_body, BODY, OF_BODY | WATCH | dict(every=Changed(2, dict(integrator="gauss_4", step=0.1)), events=["tip_z"], sensitivity=True)),
    "rigid_body_between": (
        hz.rigid_body_between,
        BETWEEN,
        {name: of for name, of in OF_BODY.items() if name != "accuracy"}
        | dict(
            inertia=(1.5, 2, 3), step=0.05, steps=20,to=(np.cos(0.5), np.sin(0.5), 0.0, 0.0), integrator="gauss_2", omega=Refused((0.0, 0.0), "`omega` has the shape")),
    ),
    "rigid_bodies": (hz.rigid_bodies, BODY | dict(omega=[BODY["omega"]] * 2), OF_BODY | dict(omega=[(1, 0.5, 0.3)] * 2, threads=Refused(0, "the number of threads is 0"))),
    "run": (
        hz.run,
        dict(scene=SCENES / "pendulum.toml"),
        WATCH | dict(scene=SCENES / "field.toml", changes={"gamma": -0.2}),
    ),
    "Event": (
        hz.Event,
        dict(when="x"),
        dict(
            when="y", direction="falling", terminal=True, reset={"x'": "-x'"}, impact="elastic", rest=Changed({"x'": "0"}, dict(impact="elastic"))
        ),
    ),
    "System": (
        hz.System,
        dict(lagrangian="x'^2/2", coordinates=["x"]),
        dict(
            lagrangian="x'^2", coordinates=["x", "y"], parameters={"k": 1.0}, tables=[("drive", DRIVE)], forces=[("x", "-x'")],
            rayleigh=["x'^2"], breaks=[1.0], constraints=Changed(["x = y"], dict(coordinates=["x", "y"])), friction=[("x", "1", None, None)], kind=Refused((True, [], "z"), "write `p_x`"),
        ),
    ),
    "Table": (hz.Table, dict(t=[0.0, 1.0, 2.0], y=[0.0, 1.0, 0.0]), dict(t=[0.0, 1.5, 2.0], y=[0.0, 2.0, 0.0], pieces="cubic")),
    "where": (
        lambda condition, x, y: hz.where(condition, x, y), dict(condition=[True, False], x=1.0, y=2.0), dict(condition=[True, True], x=3.0, y=4.0),
    ),
    "array": (hz.array, dict(values=[1.0, 2.0]), dict(values=[1.0, 3.0])),
    "Interrupted": (lambda solution: str(hz.Interrupted(solution)), dict(solution=hz.solve(**GIVEN)), dict(solution=hz.solve(**GIVEN | dict(t=2.0)))),
}  # fmt: skip
# Functions that other names of the table stand for, as what they return takes their arguments.
WRAPPED = {"body": hz.body, "method": hz.method, "value_and_grad": hz.solve, "ensemble_value_and_grad": hz.ensemble}

# Rows for JAX and PyTorch, whose functions take arguments by `options`.
DIFFERENTIABLE = dict(GIVEN, t=[0.0, 0.4, 1.0])
OF_DIFFERENTIABLE = SOLVE | NO_ROWS | dict(
    z0=Changed(0.7, dict(L="x'^2/2 - x^2/2 - z^2/10", parameters=None)),
    H=Refused("p_x^2/2", "`H` cannot be given here"),
    friction=Refused({"x": 0.2}, "`friction` cannot be given here"),
    p0=Refused([1.0], "`p0` cannot be given here"),
    momenta=Refused(["p"], "`momenta` cannot be given here"),
    events=Changed(BALL, RESET | dict(t=[0.0, 1.0, 3.0])),
    accuracy=Changed(1e-3, dict(t=[0.0, 50.0])),
)


@pytest.mark.parametrize("package", ["jax", "torch"])
@pytest.mark.parametrize("parameter", [*parameters(hz.solve), "threads"])
def test_a_differentiable_motion_takes_what_solve_takes(package, parameter):
    pytest.importorskip(package)
    if package == "jax":
        import jax

        jax.config.update("jax_enable_x64", True)
    of = importlib.import_module(f"herglotz.{package}").solve
    said = "`threads` cannot be given here" if package == "torch" else "`threads` is 0"
    # One motion of JAX does not take threads either, those of a batch do.
    batch = (lambda **given: jax.vmap(lambda x: of(**given | dict(q0=x)).q)(np.ones((3, 1)))) if parameter == "threads" and package == "jax" else of
    check(batch, DIFFERENTIABLE, (OF_DIFFERENTIABLE | dict(threads=Refused(0, said)))[parameter], parameter)


# An object of each class with methods, and for each method two calls with different results.
SOL, ENS = hz.solve(**GIVEN), hz.ensemble(**MANY)
PARTS = dict(q=np.ones((3, 1)), v=2 * np.ones((3, 1)), p=3 * np.ones((3, 1)), z=np.ones(3))
PULLBACK = {name: ({}, {name: part}) for name, part in PARTS.items()}
STOPS = dict(t=2.0, callback=lambda sol: True, callback_interval=0.0)
RESUME = dict(
    t=(dict(t=2.0), dict(t=3.0)), progress=WATCH["progress"], callback=(dict(t=2.0), STOPS),
    callback_interval=(STOPS, STOPS | dict(callback_interval=1e9)),
)  # fmt: skip
MANY_PULLBACK = {name: ({}, {name: np.stack([part, part])}) for name, part in PARTS.items()}
METHODS = {
    "Solution": (
        SOL,
        dict(
            __call__=dict(t=(dict(t=0.5), dict(t=0.6))), __getitem__=dict(name=(dict(name="x"), dict(name="x'"))),
            resume=RESUME, sensitivity=dict(variables=(dict(variables="x"), dict(variables="k"))),
            pullback=PULLBACK,
        ),
    ),
    "SparseSolution": (hz.lattice(**LATTICE), dict(resume=RESUME, __getitem__=dict(name=(dict(name="q[0]"), dict(name="v[1]"))))),
    "RigidBodySolution": (
        hz.rigid_body(**BODY, integrator="gauss_4", steps=500),
        dict(
            resume=RESUME, __call__=dict(t=(dict(t=0.5), dict(t=0.6))), __getitem__=dict(name=(dict(name="tip_z"), dict(name="z"))),
            sensitivity=dict(variables=(dict(variables="gamma"), dict(variables="omega1"))), pullback={name: ({}, {name: 1.0 if name == "z" else np.ones(3)}) for name in PARTS},
        ),
    ),
    "RigidBody": (hz.body((1, 2, 3)), dict(with_parameters=dict(parameters=(dict(parameters={"mass": 1.0}), dict(parameters={"mass": 2.0}))))),
    "SparseSystem": (
        hz.bodies([1.0, 0.5], dimensions=2),
        dict(with_parameters=dict(parameters=(dict(parameters={"G": 1.0}), dict(parameters={"G": 2.0})))),
    ),
    "Ensemble": (
        ENS,
        dict(
            __getitem__=dict(name=(dict(name="a"), dict(name="b"))), pullback=MANY_PULLBACK,
            sensitivity=dict(variables=(dict(variables="x"), dict(variables="k"))),
        ),
    ),
    "Fit": (
        hz.fit(**FITTED | dict(unknowns=["k", "gamma"])),
        dict(error=dict(name=(dict(name="k"), dict(name="gamma"))), __getitem__=dict(name=(dict(name="k"), dict(name="gamma")))),
    ),
    "Comparison": (hz.compare(**GIVEN | dict(t=0.2)), dict(best=dict(error=(dict(error=1.0), dict(error=0.0))))),
    "System": (SOL.system, dict(with_parameters=dict(parameters=(dict(parameters={"k": 2.0}), dict(parameters={"k": 3.0}))))),
    "Table": (DRIVE, dict(__call__=dict(t=(dict(t=0.1), dict(t=0.2))), values_at=dict(t=(dict(t=[0.1]), dict(t=[0.2]))))),
}  # fmt: skip
ENS._observed = {"a": ENS.z, "b": ENS.q}


def values_of(found, name=""):
    """All that a result contains, as text: without what only repeats the request, and without run times."""
    if isinstance(found, (str, bool, int, float, type(None), np.generic)):
        return repr(found)
    if isinstance(found, np.ndarray):
        return repr(found.shape) + repr(found.tolist())
    if isinstance(found, (hz.Solution, hz.Ensemble)):
        of_columns = [found[name].tolist() for name in getattr(found, "_observed")]
        return repr(of_columns) + values_of(vars(found) | dict(system=None))
    if isinstance(found, hz.System):
        return repr(found) + values_of(found.tables)
    if isinstance(found, (hz.Event, hz.Plan)):
        return repr(found)
    if isinstance(found, hz.Table):
        return repr((found.t.tolist(), found.y.tolist(), found.pieces))
    if hasattr(found, "__array__"):
        return values_of(np.asarray(found))
    if isinstance(found, hz.Comparison):
        return repr([(row.integrator, row.step, row.error) for row in found.rows])
    if isinstance(found, dict):
        return repr({key: values_of(value) for key, value in found.items() if not str(key).startswith("_")})
    if isinstance(found, (tuple, list)):
        return repr([values_of(value) for value in found])
    return values_of(vars(found) | dict(system=None))


ALL = [(name, parameter) for name, (of, *_) in CASES.items() for parameter in parameters(WRAPPED.get(name, of))]


@pytest.mark.parametrize("name, parameter", ALL, ids=[" ".join(of) for of in ALL])
def test_an_argument_has_an_effect_or_is_refused(name, parameter):
    of, given, changes = CASES[name]
    assert parameter in changes, f"add a value of `{parameter}` of `{name}` that changes the result, or must be refused"
    check(of, given, changes[parameter], parameter)


def check(of, given, change, parameter):
    """Calls a function with a value of a parameter that must change the result or be refused."""
    if not isinstance(change, (Changed, Refused)):
        change = Changed(change)
    given = {key: value for key, value in (given | change.beside).items() if value is not None}
    if isinstance(change, Refused):
        # Under transformations JAX raises an exception of its own.
        with pytest.raises((ValueError, TypeError, RuntimeError), match=f"(?s){change.message}"):
            of(**given | {parameter: change.value})
        return
    assert values_of(of(**given)) != values_of(of(**given | {parameter: change.value}))


PLOTS = {"plot", "plot_residuals"}
PUBLIC_METHODS = [
    (cls, name, parameter)
    for cls in hz.__all__
    if inspect.isclass(getattr(hz, cls)) and not issubclass(getattr(hz, cls), BaseException)
    for name, method in vars(getattr(hz, cls)).items()
    if callable(method)
    and not issubclass(getattr(hz, cls), tuple)
    and (not name.startswith("_") or name in ("__call__", "__getitem__"))
    for parameter in parameters(method)
]


@pytest.mark.parametrize("cls, name, parameter", PUBLIC_METHODS, ids=[" ".join(of) for of in PUBLIC_METHODS])
def test_an_argument_of_a_method_has_an_effect(cls, name, parameter):
    if name in PLOTS:
        assert parameter in ("ax", "coordinate"), f"add `{parameter}`: the axes are tested with the plots"
        return
    of, methods = METHODS[cls]
    method = getattr(of, name)
    if isinstance(methods[name][parameter], Refused):
        refused = methods[name][parameter]
        with pytest.raises(ValueError, match=refused.message):
            method(**{parameter: refused.value})
        return
    one, other = methods[name][parameter]
    # Methods of Python's protocols take arguments by position.
    call = (lambda given: method(*given.values())) if name.startswith("_") else (lambda given: method(**given))
    assert values_of(call(one)) != values_of(call(other))


def test_all_functions_are_walked():
    known = {name.removesuffix("()") for name in CASES}
    functions = {name for name in hz.__all__ if not inspect.isclass(getattr(hz, name)) and parameters(getattr(hz, name))}
    assert functions <= known
    assert {"value_and_grad()", "ensemble_value_and_grad()"} <= set(CASES)
    # A class of results is made by functions.
    assert {"Event", "System", "Table", "Interrupted"} <= known
