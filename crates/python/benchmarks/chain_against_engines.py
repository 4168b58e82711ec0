"""A chain of 128 rigid rods compared with multibody programs: time of a step, error and energy error.

    pip install dartpy exudyn mujoco numpy
    cargo build --release --bin scale
    python benchmarks/chain_against_engines.py target/release/scale

The chain is `RodChain` of the crate sparse-herglotz, without drag: 128 point masses of 1 kg in a vertical plane, joined
by rods of 0.1 m without mass, hung from a fixed point and released from a line at 0.5 radians to the vertical. It
swings for 2 s.

- herglotz: `SparseRattle`, with Cartesian coordinates and constraints; the program `scale --quick --case rods` runs it.
- MuJoCo and DART: hinges, in joint angles. A body has moments of inertia of 1e-12 kg m^2 instead of 0.
- exudyn: point masses with distance constraints and a sparse solver, by the generalised alpha method and the
  trapezoidal rule of index 2; and a kinematic tree in joint angles by an explicit Runge-Kutta method.

In each round every program has its turn, and the least time counts. Times are processor times of one thread, without
the construction of the models. Those of herglotz are wall times, sums of the least times of a hundred parts of the run.
The programs keep their default tolerances, and nothing is projected. The error is the 2-norm of that of the last mass
at the end, the energy error the largest at a hundred times, relative to the energy that the chain can release. The
reference is a run of MuJoCo's RK4 with steps of 5e-4 s, which has neither the coordinates nor the method of herglotz.
"""

import csv
import subprocess
import sys
import tempfile
import time
import warnings
from itertools import product
from pathlib import Path

import numpy as np
from heavy_top_against_engines import exudyn_settings, quiet

LINKS, LENGTH, MASS, GRAVITY, ANGLE, END = 128, 0.1, 1.0, 9.81, 0.5, 2.0
INERTIA = 1e-12
ROUNDS = 3
RELEASED = MASS * GRAVITY * LENGTH * LINKS * (LINKS + 1) / 2 * (1 - np.cos(ANGLE))


def energy(x, v):
    """The energy of masses with positions and velocities of shape (128, 2)."""
    return MASS * (np.sum(v * v) / 2 + GRAVITY * np.sum(x[:, 1]))


def of_joints(angles, rates):
    """Positions and velocities of the masses from the angles between the links and their rates."""
    angles, rates = np.cumsum(angles), np.cumsum(rates)
    x = LENGTH * np.cumsum(np.stack([np.sin(angles), -np.cos(angles)], axis=1), axis=0)
    v = LENGTH * np.cumsum(np.stack([np.cos(angles) * rates, np.sin(angles) * rates], axis=1), axis=0)
    return x, v


def start():
    angles = np.zeros(LINKS)
    angles[0] = ANGLE
    return angles


def of_mujoco(integrator, h):
    import mujoco

    quiet(mujoco)
    link = """<body pos="0 {} 0"><joint type="hinge" axis="0 0 1"/>
              <inertial pos="0 {} 0" mass="{}" diaginertia="{i} {i} {i}"/>"""
    links = "".join(link.format(-LENGTH if k else 0, -LENGTH, MASS, i=INERTIA) for k in range(LINKS))
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="{h!r}" integrator="{integrator}" gravity="0 {-GRAVITY} 0"/>
              <worldbody>{links}{"</body>" * LINKS}</worldbody>
            </mujoco>"""
    )
    data = mujoco.MjData(model)

    def run(parts):
        mujoco.mj_resetData(model, data)
        data.qpos[:] = start()
        seconds, states = 0.0, []
        for _ in range(parts):
            begin = time.process_time()
            mujoco.mj_step(model, data, round(END / h) // parts)
            seconds += time.process_time() - begin
            states.append(of_joints(data.qpos, data.qvel))
        return seconds, states

    return run


def of_dart(h):
    import dartpy as dart

    def model():
        chain, body = dart.dynamics.Skeleton("chain"), None
        for k in range(LINKS):
            hinge = dart.dynamics.RevoluteJointProperties()
            hinge.mAxis = np.array([0.0, 0.0, 1.0])
            place = np.eye(4)
            place[1, 3] = -LENGTH if k else 0.0
            hinge.mT_ParentBodyToJoint = dart.math.Isometry3(place)
            _, body = chain.createRevoluteJointAndBodyNodePair(body, hinge)
            body.setInertia(dart.dynamics.Inertia(MASS, [0.0, -LENGTH, 0.0], INERTIA * np.eye(3)))
        chain.setPositions(start())
        world = dart.simulation.World()
        world.setGravity([0.0, -GRAVITY, 0.0])
        world.setTimeStep(h)
        world.addSkeleton(chain)
        return world, chain

    def run(parts):
        world, chain = model()
        seconds, states = 0.0, []
        for _ in range(parts):
            begin = time.process_time()
            for _ in range(round(END / h) // parts):
                world.step()
            seconds += time.process_time() - begin
            states.append(of_joints(chain.getPositions(), chain.getVelocities()))
        return seconds, states

    return run


def masses_of_exudyn(system, items):
    """Point masses and distance constraints; returns a function that reads positions and velocities."""
    import exudyn

    x, _ = of_joints(start(), np.zeros(LINKS))
    before = system.AddMarker(items.MarkerBodyPosition(bodyNumber=system.AddObject(items.ObjectGround())))
    nodes = []
    for place in x:
        nodes.append(system.AddNode(items.NodePoint2D(referenceCoordinates=place)))
        body = system.AddObject(items.MassPoint2D(mass=MASS, nodeNumber=nodes[-1]))
        marker = system.AddMarker(items.MarkerBodyPosition(bodyNumber=body))
        system.AddLoad(items.Force(markerNumber=marker, loadVector=[0.0, -MASS * GRAVITY, 0.0]))
        system.AddObject(items.DistanceConstraint(markerNumbers=[before, marker], distance=LENGTH))
        before = marker
    output = exudyn.OutputVariableType

    def state():
        return tuple(
            np.array([system.GetNodeOutput(node, kind)[:2] for node in nodes])
            for kind in (output.Position, output.Velocity)
        )

    return state


def tree_of_exudyn(system, items):
    """A kinematic tree of revolute joints; returns a function that reads positions and velocities."""
    import exudyn

    node = system.AddNode(
        items.NodeGenericODE2(
            referenceCoordinates=start(),
            initialCoordinates=np.zeros(LINKS),
            initialCoordinates_t=np.zeros(LINKS),
            numberOfODE2Coordinates=LINKS,
        )
    )
    offsets = [[0.0, -LENGTH if k else 0.0, 0.0] for k in range(LINKS)]
    system.AddObject(
        items.ObjectKinematicTree(
            nodeNumber=node,
            jointTypes=[exudyn.JointType.RevoluteZ] * LINKS,
            linkParents=list(range(-1, LINKS - 1)),
            jointTransformations=exudyn.Matrix3DList([np.eye(3)] * LINKS),
            jointOffsets=exudyn.Vector3DList(offsets),
            linkInertiasCOM=exudyn.Matrix3DList([INERTIA * np.eye(3)] * LINKS),
            linkCOMs=exudyn.Vector3DList([[0.0, -LENGTH, 0.0]] * LINKS),
            linkMasses=[MASS] * LINKS,
            gravity=[0.0, -GRAVITY, 0.0],
        )
    )
    output = exudyn.OutputVariableType

    def state():
        angles = system.GetNodeOutput(node, output.Coordinates) + start()
        return of_joints(angles, system.GetNodeOutput(node, output.Coordinates_t))

    return state


def of_exudyn(integrator, h):
    import exudyn
    import exudyn.utilities as items

    quiet(exudyn)
    model = tree_of_exudyn if integrator.startswith("RK") else masses_of_exudyn

    def run(parts):
        container = exudyn.SystemContainer()
        system = container.AddSystem()
        state, states = model(system, items), []

        def observe(*_):
            states.append(state())
            return [0.0]

        if parts > 1:
            sensor = items.SensorUserFunction(sensorUserFunction=observe, writeToFile=False, storeInternal=True)
            system.AddSensor(sensor)
        system.Assemble()
        settings = exudyn_settings(round(END / h), END, parts)
        if model is masses_of_exudyn:
            settings.linearSolver.solverType = exudyn.LinearSolverType.EigenSparse
        begin = time.process_time()
        system.SolveDynamic(settings, solverType=getattr(exudyn.DynamicSolverType, integrator))
        return time.process_time() - begin, [*states, state()]

    return run


def of_herglotz(program):
    """The rows that a run of `scale` writes: scheme, h, seconds of a step, energy error, and the end of the chain."""
    with tempfile.TemporaryDirectory() as folder:
        command = [program, "--quick", "--case", "rods", "--out", folder]
        # The exit code tells whether the bounds of the case hold, which does not matter here.
        subprocess.run(command, capture_output=True, check=False)
        with open(Path(folder) / "rods_energy.csv", newline="") as table:
            return list(csv.DictReader(table))


def main():
    if len(sys.argv) != 2:
        sys.exit("give the path of the program `scale`, such as target/release/scale")
    warnings.simplefilter("ignore", DeprecationWarning)
    _, states = of_mujoco("RK4", 5e-4)(1)
    reference = states[-1][0][-1]
    initial = energy(*of_joints(start(), np.zeros(LINKS)))
    ways = [("MuJoCo", name, h, of_mujoco(name, h)) for name in ("Euler", "implicit", "RK4") for h in (4e-3, 1e-3)]
    ways += [("DART", "semi-implicit Euler", h, of_dart(h)) for h in (4e-3, 1e-3)]
    for name, h in product(("GeneralizedAlpha", "TrapezoidalIndex2"), (4e-3, 1e-3)):
        ways.append(("exudyn", name, h, of_exudyn(name, h)))
    # A step takes a hundred times as long as one of herglotz.
    ways.append(("exudyn", "RK44", 4e-3, of_exudyn("RK44", 4e-3)))
    rows = []
    for program, name, h, run in ways:
        try:
            _, states = run(100)
        except Exception as failure:
            print(f"{program}, {name}, h = {h}: {str(failure).splitlines()[0]}")
            continue
        drift = max(abs(energy(*state) - initial) for state in states) / RELEASED
        rows.append([program, name, h, np.inf, np.linalg.norm(states[-1][0][-1] - reference), drift, run])
    ours = {}
    for _ in range(ROUNDS):
        for row in of_herglotz(sys.argv[1]):
            key = row["scheme"], float(row["h"])
            error = np.linalg.norm(np.array([float(row["tip_x"]), float(row["tip_y"])]) - reference)
            seconds = min(float(row["seconds"]), ours[key][3] if key in ours else np.inf)
            ours[key] = ["herglotz", *key, seconds, error, float(row["energy_error"]), None]
        for row in rows:
            row[3] = min(row[3], row[6](1)[0] / round(END / row[2]))
    print("The ratios are to a step of herglotz's `strang` of the same length.\n")
    print("| program | method | h, ms | time of a step, ms | ratio | for 2 s, ms | error, m | energy error |")
    print("|---|---|---|---|---|---|---|---|")
    for program, name, h, seconds, error, drift, _ in sorted([*ours.values(), *rows], key=lambda row: row[3] / row[2]):
        print(
            f"| {program} | {name} | {h * 1e3:g} | {seconds * 1e3:.3f} | {seconds / ours['strang', h][3]:.2g} | "
            f"{seconds * END / h * 1e3:.3g} | {error:.1e} | {drift:.1e} |"
        )


if __name__ == "__main__":
    main()
