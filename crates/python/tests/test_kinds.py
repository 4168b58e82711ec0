"""What each kind of system can do: every capability works, or is refused with a message, or does not exist.

The table is the one list of what is missing. A cell is `WORKS`, the message of a refusal, or `NONE` where there is no such
argument or method; a cell that is better than the table says fails too, so that the table stays true.
"""

import herglotz as hz
import numpy as np
import pytest

WORKS, NONE = "works", "there is none"

FREE = dict(L="(x'^2 + y'^2)/2 - k*(x^2 + 2*y^2)/2 + gamma*z", q0=[1.0, 0.5], v0=[0.0, 0.3], coordinates=["x", "y"], parameters={"k": 1.3, "gamma": -0.1})
FORCED = FREE | dict(force={"x": "-x'^3/5"})
HAMILTONIAN = dict(H="(p_x^2 + p_y^2)/2 + k*(x^2 + 2*y^2)/2 - gamma*z", q0=[1.0, 0.5], p0=[0.0, 0.3], coordinates=["x", "y"], parameters={"k": 1.3, "gamma": -0.1})
HELD = FREE | dict(constraints="x^2 + y^2 = 5/4", v0=[-0.1, 0.2])
BODY = dict(inertia=(1, 2, 3), mass=1.0, centre=(0.0, 0.1, 0.2), gravity=(0.0, 0.0, -1.0), gamma=-0.1)
OMEGA = [1.0, 0.5, 0.25]
LATTICE = hz.lattice("x'^2/2 + k*cos(x) + gamma*z", "-(xr - xl)^2/2", sites=4, parameters={"k": 1.0, "gamma": -0.1})
BODIES = hz.bodies([1.0, 0.5], dimensions=2, gamma=-0.1)

T = np.linspace(0.0, 1.0, 5)
STEPS = dict(integrator="gauss_2", step=0.05)


class Kind:
    """A kind of system: the arguments of `solve` for it, a coordinate and a parameter, and the ends of a path."""

    def __init__(self, given, column="x", parameter="k", ends=([1.0, 0.5], [0.9, 0.6]), steps=STEPS):
        self.given, self.column, self.parameter, self.ends, self.steps = given, column, parameter, ends, steps

    def call(self, function, **more):
        """Another function with the same system and start."""
        return function(**self.given | self.steps | more)

    def run(self, t=T, **more):
        given = self.given if "accuracy" in more or "step" in more else self.given | self.steps
        return hz.solve(**given | {"t": t} | more)

    def without_start(self):
        """The arguments that belong to the system."""
        return {name: x for name, x in self.given.items() if name not in ("q0", "v0", "p0")}


KINDS = {
    "L": Kind(FREE),
    "L with force": Kind(FORCED),
    "H": Kind(HAMILTONIAN),
    "constraints": Kind(HELD),
    "rigid body": Kind(dict(L=hz.body(**BODY), v0=OMEGA), "tip_z", "mass"),
    "lattice": Kind(dict(L=LATTICE, q0=[0.1, 0.3, 0.0, 0.2], v0=[0.0] * 4), "x[0]", ends=([0.1, 0.3, 0.0, 0.2], [0.0, 0.2, 0.1, 0.2])),
    "bodies": Kind(dict(L=BODIES, q0=[[0.0, 0.0], [1.0, 0.0]], v0=[[0.0, 0.0], [0.0, 1.0]]), "x_1", "G", ([0.0, 0.0, 1.0, 0.0], [0.0, 0.1, 0.9, 0.5])),
}  # fmt: skip
LEVELS = {"tip_z": 0.15, "x[0]": 0.11, "x_1": 0.9}


def event(kind):
    return f"{kind.column} - {LEVELS.get(kind.column, 0.3)}"


def flat(kind):
    """The system and the start, as flat arrays."""
    return kind.without_start() | {name: np.ravel(kind.given[name]) for name in ("q0", "v0", "p0") if name in kind.given}


def system(kind):
    """The system of a kind, without a start."""
    given = kind.without_start()
    return hz.system(**given) if {"H", "force", "constraints"} & set(given) or isinstance(given["L"], str) else given["L"]


def ensemble(kind):
    rows = {name: np.stack([np.ravel(kind.given[name])] * 2) for name in ("q0", "v0", "p0") if name in kind.given}
    return hz.ensemble(**kind.without_start() | rows, t=T, **kind.steps)


def reset(kind):
    velocity = {"x[0]": "x'[0]", "x_1": "x_1'"}.get(kind.column, "x'")
    return hz.Event(event(kind), reset={velocity: f"-{velocity}/2"})


def jax_rows(kind):
    pytest.importorskip("jax")
    import herglotz.jax as hj

    # A motion of a Hamiltonian starts from the velocity as well.
    velocity = kind.given.get("v0", kind.given.get("p0"))
    q0 = np.ravel(kind.given["q0"]) if "q0" in kind.given else np.zeros(3)
    return hj.solve(system(kind), q0, np.ravel(velocity), T, **kind.steps)


def path(kind):
    if kind.column == "tip_z":
        return hz.path(kind.given["L"], (1.0, 0.0, 0.0, 0.0), (np.cos(0.4), np.sin(0.4), 0.0, 0.0), 1.0, steps=20)
    return hz.path(system(kind), kind.ends[0], kind.ends[1], 1.0, steps=8, integrator="midpoint")


CAPABILITIES = {
    "given steps": lambda kind: kind.run(),
    "accuracy": lambda kind: kind.run(accuracy=1e-6),
    "rows at times": lambda kind: kind.run()[kind.column][3],
    "states between rows": lambda kind: kind.run()(0.33),
    "events": lambda kind: kind.run(events=event(kind)).events,
    "terminal events": lambda kind: kind.run(events=hz.Event(event(kind), terminal=True)).end,
    "resets": lambda kind: kind.run(events=reset(kind)).events,
    "backward": lambda kind: kind.run(t=[0.0, -0.5, -1.0]),
    "breaks": lambda kind: kind.run(breaks=[0.35]),
    "plan": lambda kind: str(kind.run().plan),
    "check": lambda kind: hz.check(**flat(kind), t=1.0, **kind.steps),
    "compare": lambda kind: hz.compare(**flat(kind), t=0.1),
    "resume": lambda kind: kind.run().resume(1.5),
    "progress and callback": lambda kind: kind.run(callback=lambda sol: False, callback_interval=0.0),
    "ensemble": ensemble,
    "derivatives": lambda kind: kind.run().sensitivity(kind.parameter),
    "adjoint": lambda kind: kind.run().pullback(q=np.eye(np.size(kind.given["v0" if "v0" in kind.given else "p0"]))[0]),
    "loss": lambda kind: hz.value_and_grad(kind.column)(**flat(kind), t=1.0, **kind.steps),
    "derivatives of times of events": lambda kind: kind.run(events=event(kind)).sensitivity(kind.parameter).event_times,
    "Lyapunov exponents": lambda kind: kind.run().lyapunov_exponents(),
    "fit": lambda kind: hz.fit(**flat(kind), t=T[1:], t0=0.0, data={kind.column: kind.run()[kind.column][1:]}, unknowns=[kind.parameter], **kind.steps),
    "path": path,
    "own method": lambda kind: kind.run(integrator=hz.method(lambda L, t, q0, q1, z0, h: h * L(t, q0, (q1 - q0) / h, z0), 1), step=0.05),
    "JAX": jax_rows,
    "pandas": lambda kind: (pytest.importorskip("pandas"), kind.run().to_pandas()),
    "xarray": lambda kind: (pytest.importorskip("xarray"), kind.run().to_xarray()),
    "picture": lambda kind: (pytest.importorskip("matplotlib.pyplot").switch_backend("Agg"), kind.run().plot()),
}  # fmt: skip

# Of a kind, what does not work; everything else does.
OTHERWISE = {
    "L": {},
    "L with force": {"own method": "without forces, constraints and resets"},
    "H": {"resets": "Hamiltonian", "path": "for a Hamiltonian", "own method": "takes no Hamiltonian"},
    "constraints": {
        "resets": "combined with resets",
        "breaks": "steps under constraints do not end on them",
        "path": "not computed with constraints",
        "own method": "without forces, constraints and resets",
    },
    "rigid body": {
        "resets": "without a reset",
        "breaks": "is not there for rigid bodies",
        "compare": "a rigid body is not a formula",
        "Lyapunov exponents": NONE,
        "fit": "a rigid body is not a formula",
        "own method": NONE,
        "JAX": "a rigid body is not a formula",
    },
    "lattice": {},
    "bodies": {},
}


def found(kind, capability):
    """What a cell is: works, there is none, or the message of a refusal."""
    try:
        CAPABILITIES[capability](KINDS[kind])
    except (AttributeError, TypeError, KeyError):
        return NONE
    except ValueError as error:
        return str(error)
    return WORKS


@pytest.mark.parametrize("capability", CAPABILITIES)
@pytest.mark.parametrize("kind", KINDS)
def test_a_cell_of_the_table(kind, capability):
    said, cell = OTHERWISE[kind].get(capability, WORKS), found(kind, capability)
    if said in (WORKS, NONE):
        assert cell == said, f"{kind}, {capability}: {cell}"
    else:
        assert cell not in (WORKS, NONE) and said in cell, f"{kind}, {capability}: {cell}"


def test_the_share_that_works():
    cells = [(kind, capability) for kind in KINDS for capability in CAPABILITIES]
    works = sum(capability not in OTHERWISE[kind] for kind, capability in cells)
    # It may grow.
    assert works / len(cells) >= 0.9, f"{works} of {len(cells)}"
