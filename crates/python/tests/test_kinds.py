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
BODY = dict(inertia=(1, 2, 3), omega=(1.0, 0.5, 0.25), mass=1.0, centre=(0.0, 0.1, 0.2), gravity=(0.0, 0.0, -1.0), gamma=-0.1)
LATTICE = dict(site="x'^2/2 + k*cos(x) + gamma*z", bond="-(xr - xl)^2/2", q0=[0.1, 0.3, 0.0, 0.2], v0=0.0, parameters={"k": 1.0, "gamma": -0.1})
BODIES = dict(masses=[1.0, 0.5], q0=[[0.0, 0.0], [1.0, 0.0]], v0=[[0.0, 0.0], [0.0, 1.0]], gamma=-0.1)

T = np.linspace(0.0, 1.0, 5)
STEPS = dict(integrator="gauss_2", step=0.05)


class Kind:
    """A kind of system: a function that runs it, its arguments, and a name of a column."""

    def __init__(self, run, given, column, steps=STEPS):
        self.run_by, self.given, self.column, self.steps = run, given, column, steps

    def run(self, t=T, **more):
        if "accuracy" not in more and "step" not in more:
            more = self.steps | more
        return self.run_by(**self.given, t=t, **more)


KINDS = {
    "L": Kind(hz.solve, FREE, "x"),
    "L with force": Kind(hz.solve, FORCED, "x"),
    "H": Kind(hz.solve, HAMILTONIAN, "x"),
    "constraints": Kind(hz.solve, HELD, "x"),
    "rigid body": Kind(hz.rigid_body, BODY, "tip_z"),
    "lattice": Kind(hz.lattice, LATTICE, "q[0]"),
    "bodies": Kind(hz.bodies, BODIES, "q[1, 0]"),
}


def event(kind):
    return {"tip_z": "tip_z - 0.15"}.get(kind.column, f"{kind.column} - 0.3")


def member(kind, function, **more):
    """The call of a function beside `solve` with the same system."""
    return function(**kind.given, **more)


def ensemble(kind):
    if kind.run_by is hz.rigid_body:
        return hz.rigid_bodies(**BODY | dict(omega=[(1.0, 0.5, 0.25), (1.0, 0.4, 0.25)]), t=T, **STEPS)
    rows = {name: np.stack([np.asarray(kind.given[name])] * 2) for name in ("q0", "v0", "p0") if name in kind.given}
    return member(Kind(None, kind.given | rows, None), hz.ensemble, t=T, **kind.steps)


def derivatives(kind):
    if kind.run_by is hz.rigid_body:
        return kind.run(sensitivity=True).derivatives
    return kind.run().sensitivity("k")


def jax_rows(kind):
    pytest.importorskip("jax")
    import herglotz.jax as hj

    return member(kind, hj.solve, t=T, **kind.steps)


CAPABILITIES = {
    "given steps": lambda kind: kind.run(),
    "accuracy": lambda kind: kind.run(accuracy=1e-6),
    "rows at times": lambda kind: kind.run()[kind.column][3],
    "states between rows": lambda kind: kind.run()(0.33),
    "events": lambda kind: kind.run(events=event(kind)).events,
    "terminal events": lambda kind: kind.run(events=hz.Event(event(kind), terminal=True)).end,
    "resets": lambda kind: kind.run(events=hz.Event("x", "falling", reset={"x'": "-x'/2"})).events,
    "backward": lambda kind: kind.run(t=[0.0, -0.5, -1.0]),
    "breaks": lambda kind: kind.run(breaks=[0.35]),
    "plan": lambda kind: str(kind.run().plan),
    "check": lambda kind: member(kind, hz.check, t=1.0, **kind.steps),
    "compare": lambda kind: member(kind, hz.compare, t=0.1),
    "resume": lambda kind: kind.run().resume(1.5),
    "progress and callback": lambda kind: kind.run(callback=lambda sol: False, callback_interval=0.0),
    "ensemble": ensemble,
    "derivatives": derivatives,
    "adjoint": lambda kind: kind.run().pullback(q=[1.0, 0.0]),
    "loss": lambda kind: member(kind, hz.value_and_grad("x + x'"), t=1.0, **kind.steps),
    "derivatives of times of events": lambda kind: kind.run(events=event(kind)).sensitivity("k").event_times,
    "Lyapunov exponents": lambda kind: kind.run().lyapunov_exponents(),
    "fit": lambda kind: member(kind, hz.fit, t=T[1:], t0=0.0, data={kind.column: np.cos(T[1:])}, unknowns=["k"], **kind.steps),
    "path": lambda kind: hz.path(kind.given["L"], [1.0, 0.5], [0.9, 0.6], 1.0, steps=8, coordinates=["x", "y"], parameters=kind.given["parameters"], force=kind.given.get("force"), integrator="midpoint", **({"constraints": kind.given["constraints"]} if "constraints" in kind.given else {})),
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
    "H": {
        "resets": "Hamiltonian",
        "path": NONE,
        "own method": "takes no Hamiltonian",
        "fit": NONE,
        "JAX": "`H` cannot be given here",
        "check": NONE,
        "compare": NONE,
        "ensemble": NONE,
    },
    "constraints": {
        "resets": "combined with resets",
        "breaks": "steps under constraints do not end on them",
        "check": NONE,
        "compare": NONE,
        "ensemble": NONE,
        "Lyapunov exponents": "not computed with constraints",
        "path": NONE,
        "own method": "without forces, constraints and resets",
    },
    "rigid body": {
        "states between rows": NONE,
        "resets": "x",
        "breaks": NONE,
        "plan": NONE,
        "resume": NONE,
        "check": NONE,
        "compare": NONE,
        "adjoint": NONE,
        "loss": NONE,
        "derivatives of times of events": NONE,
        "Lyapunov exponents": NONE,
        "fit": NONE,
        "path": NONE,
        "own method": NONE,
        "JAX": NONE,
    },
}
OF_MANY = {
    name: NONE
    for name in CAPABILITIES
    if name
    not in ("given steps", "rows at times", "backward", "resume", "progress and callback", "pandas", "xarray", "picture")
}
OTHERWISE |= {"lattice": OF_MANY, "bodies": OF_MANY}


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
    assert works / len(cells) >= 0.55, f"{works} of {len(cells)}"
