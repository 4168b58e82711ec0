"""The heavy top from Python compared with multibody programs: error and energy error against processor time.

    pip install dartpy exudyn mujoco numpy
    python benchmarks/heavy_top_against_engines.py

The top is that of Bruels and Cardona (2010), without drag, over 2 time units with steps of equal length. Two of its
moments of inertia are equal, so that the free rotation is known in closed form, which the splittings use. The second
top has three different moments.

In each round every run of every program has its turn; the least time counts. Times are processor times of one thread,
without the construction of the models. The programs keep their default tolerances, and nothing is projected.

- herglotz: `rigid_body`, splittings on the rotation group.
- MuJoCo: a ball joint; its integrators Euler, implicit and RK4.
- exudyn: a body with Euler parameters and a spherical joint, by the generalised alpha method and the trapezoidal rule
  of index 2; and a body on the rotation group by explicit Runge-Kutta methods. An explicit method permits no joint, so
  the body is given its inertia about the fixed point, its position is held, and its weight is a load at the centre.
- DART: a ball joint and its only integrator, the semi-implicit Euler method. With longer steps than here it diverges.

The error is the 2-norm of that of the centre of mass at the end. The energy error is the largest at up to a hundred
times, relative to the energy at the start, which is nearly all that of the rotation: the weight can change it by 5 per
cent at most.
"""

import time
import warnings

import numpy as np

MASS, GRAVITY, CENTRE = 15.0, 9.81, np.array([0.0, 1.0, 0.0])
# The moments of inertia about the centre of mass.
SYMMETRIC = np.array([0.234375, 0.46875, 0.234375])
DIFFERENT = np.array([0.234375, 0.46875, 0.35])
OMEGA = np.array([0.0, 150.0, -4.61538])
END = 2.0
# The displacement of the centre of mass of the symmetric top at the end, by Taylor's method.
DISPLACEMENT = np.array([-0.150416822746, -1.724165591637, -0.673022269560])
BUDGETS = [1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1]


def moments(at_centre):
    """The moments of inertia about the fixed point."""
    return at_centre + MASS * np.array([1.0, 0.0, 1.0])


def energy(at_centre, omega, centre):
    return omega @ (moments(at_centre) * omega) / 2 + MASS * GRAVITY * centre[2]


def of_herglotz(at_centre, integrator, steps):
    import herglotz as hz

    top = {"inertia": at_centre, "mass": MASS, "centre": CENTRE, "gravity": (0.0, 0.0, -GRAVITY), "omega": OMEGA}

    def run(parts):
        every = None if parts == 1 else max(1, steps // parts)
        begin = time.process_time()
        sol = hz.rigid_body(**top, t=END, integrator=integrator, steps=steps, every=every)
        seconds = time.process_time() - begin
        return seconds, sol.end.tip[0], [energy(at_centre, omega, tip) for omega, tip in zip(sol.omega, sol.tip)]

    return run


def quiet(program):
    """Turns off messages of MuJoCo about runs that diverge, with their log file, and of exudyn about its progress."""
    if program.__name__ == "mujoco":
        program.set_mju_user_warning(lambda message: None)
    else:
        program.config.printToConsole = False


def of_mujoco(at_centre, integrator, steps):
    import mujoco

    quiet(mujoco)
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco>
              <option timestep="{END / steps!r}" integrator="{integrator}" gravity="0 0 {-GRAVITY}">
                <flag autoreset="disable"/>
              </option>
              <worldbody><body>
                <joint type="ball"/>
                <inertial pos="0 1 0" mass="{MASS}" diaginertia="{at_centre[0]} {at_centre[1]} {at_centre[2]}"/>
              </body></worldbody>
            </mujoco>"""
    )
    data = mujoco.MjData(model)

    def run(parts):
        mujoco.mj_resetData(model, data)
        data.qvel[:] = OMEGA
        seconds, energies = 0.0, []
        for _ in range(parts):
            begin = time.process_time()
            mujoco.mj_step(model, data, steps // parts)
            seconds += time.process_time() - begin
            mujoco.mj_forward(model, data)
            energies.append(energy(at_centre, data.qvel, data.xipos[1]))
        return seconds, data.xipos[1].copy(), energies

    return run


def of_dart(at_centre, steps):
    import dartpy as dart

    def run(parts):
        top = dart.dynamics.Skeleton("top")
        _, body = top.createBallJointAndBodyNodePair()
        body.setInertia(dart.dynamics.Inertia(MASS, CENTRE, np.diag(at_centre)))
        top.setVelocities(OMEGA)
        world = dart.simulation.World()
        world.setGravity([0.0, 0.0, -GRAVITY])
        world.setTimeStep(END / steps)
        world.addSkeleton(top)
        seconds, energies = 0.0, []
        for _ in range(parts):
            begin = time.process_time()
            for _ in range(steps // parts):
                world.step()
            seconds += time.process_time() - begin
            energies.append(energy(at_centre, top.getVelocities(), body.getCOM()))
        return seconds, body.getCOM(), energies

    return run


def exudyn_settings(steps, end, parts):
    """Settings for a run without output files, and with `parts` calls of its sensors."""
    import exudyn

    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = end
    # The adaptive integrators keep the step too.
    settings.timeIntegration.automaticStepSize = False
    settings.timeIntegration.adaptiveStep = False
    settings.parallel.numberOfThreads = 1
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = end / parts
    return settings


def of_exudyn(at_centre, integrator, steps):
    import exudyn
    import exudyn.utilities as items

    quiet(exudyn)
    explicit = integrator not in ("GeneralizedAlpha", "TrapezoidalIndex2")
    solver = getattr(exudyn.DynamicSolverType, integrator)

    def model():
        container = exudyn.SystemContainer()
        system = container.AddSystem()
        if explicit:
            body = system.CreateRigidBody(
                inertia=items.RigidBodyInertia(MASS, np.diag(moments(at_centre))),
                initialAngularVelocity=OMEGA,
                nodeType=exudyn.NodeType.RotationRotationVector,
            )
            node = system.GetObject(body)["nodeNumber"]
            ground = system.AddMarker(
                items.MarkerNodeCoordinate(nodeNumber=system.AddNode(items.NodePointGround()), coordinate=0)
            )
            for axis in range(3):
                held = system.AddMarker(items.MarkerNodeCoordinate(nodeNumber=node, coordinate=axis))
                system.AddObject(items.CoordinateConstraint(markerNumbers=[ground, held]))
            centre = system.AddMarker(items.MarkerBodyPosition(bodyNumber=body, localPosition=CENTRE))
            system.AddLoad(items.Force(markerNumber=centre, loadVector=[0.0, 0.0, -MASS * GRAVITY]))
        else:
            body = system.CreateRigidBody(
                inertia=items.RigidBodyInertia(MASS, np.diag(at_centre), CENTRE, inertiaTensorAtCOM=True),
                initialAngularVelocity=OMEGA,
                gravity=[0.0, 0.0, -GRAVITY],
                nodeType=exudyn.NodeType.RotationEulerParameters,
            )
            system.CreateSphericalJoint(itemNumbers=[system.CreateGround(), body], position=[0.0, 0.0, 0.0])
        return container, system, body

    def run(parts):
        _, system, body = model()
        output = exudyn.OutputVariableType

        def centre():
            return system.GetObjectOutputBody(body, output.Position, localPosition=CENTRE)

        energies = []

        def observe(*_):
            omega = system.GetObjectOutputBody(body, output.AngularVelocityLocal, localPosition=[0.0, 0.0, 0.0])
            energies.append(energy(at_centre, omega, centre()))
            return [energies[-1]]

        if parts > 1:
            sensor = items.SensorUserFunction(sensorUserFunction=observe, writeToFile=False, storeInternal=True)
            system.AddSensor(sensor)
        system.Assemble()
        settings = exudyn_settings(steps, END, parts)
        begin = time.process_time()
        system.SolveDynamic(settings, solverType=solver)
        return time.process_time() - begin, centre(), energies

    return run


def measured(runs, rounds, reference, start):
    """For each run its least time, its error at the end, and its largest energy error relative to that at the start.

    A run is the program, its settings, and a function that runs in a number of parts and returns the time, the end, and
    the energies after the parts. Runs that fail are left out.
    """
    found = []
    for program, settings, run in runs:
        try:
            _, end, energies = run(100)
        except Exception as failure:
            print(f"{program}, {settings}: {str(failure).splitlines()[0]}")
            continue
        with np.errstate(all="ignore"):
            drift = np.max(np.abs(np.array(energies) / start - 1))
        found.append([program, settings, run, np.inf, np.linalg.norm(end - reference), drift])
    for _ in range(rounds):
        for way in found:
            way[3] = min(way[3], way[2](1)[0])
    return sorted(([*way[:2], *way[3:]] for way in found), key=lambda way: way[2])


def at_the_same_cost(found, budgets):
    """For each time and program the most accurate run within it, as a table."""
    programs = list(dict.fromkeys(way[0] for way in found))
    print("| time, ms | " + " | ".join(programs) + " |")
    print("|---" * (len(programs) + 1) + "|")
    for budget in budgets:
        cells = []
        for program in programs:
            within = [way for way in found if way[0] == program and way[2] <= budget and np.isfinite(way[3])]
            best = min(within, key=lambda way: way[3], default=None)
            cells.append(f"{best[3]:.1e}, {best[4]:.1e}" if best else "-")
        print(f"| {budget * 1e3:g} | " + " | ".join(cells) + " |")


def compare(at_centre, reference, ours):
    of_mujoco_runs = {
        "Euler": (10000, 50000),
        "implicit": (2000, 10000, 20000),
        "RK4": (500, 1000, 2000, 5000, 10000, 20000),
    }
    of_exudyn_runs = {
        "GeneralizedAlpha": (1000, 2000, 10000),
        "TrapezoidalIndex2": (1000, 2000, 10000),
        "RK44": (500, 1000, 2000, 5000, 10000),
        "RK67": (500, 1000, 2000, 5000, 10000),
    }
    programs = [
        ("herglotz", of_herglotz, ours),
        ("MuJoCo", of_mujoco, of_mujoco_runs),
        ("exudyn", of_exudyn, of_exudyn_runs),
    ]
    runs = [
        (program, f"{integrator}, {steps} steps", way(at_centre, integrator, steps))
        for program, way, counts in programs
        for integrator in counts
        for steps in counts[integrator]
    ]
    runs += [("DART", f"{steps} steps", of_dart(at_centre, steps)) for steps in (20000, 100000, 200000)]
    start = energy(at_centre, OMEGA, CENTRE)
    found = measured(runs, 5, reference, start)
    for program, settings, seconds, error, drift in found:
        print(f"{seconds * 1e3:9.3f} ms  error {error:8.1e}  energy {drift:8.1e}  {program}, {settings}")
    print("\nerror, energy error of the most accurate run within a time\n")
    at_the_same_cost(found, BUDGETS)


def main():
    warnings.simplefilter("ignore", DeprecationWarning)
    compositions = {
        "strang": (200, 1000, 5000, 20000),
        "kahan_li_8": (50, 100, 200, 400, 800),
        "sofroniou_spaletta_10": (50, 100, 200, 400),
    }
    print("Two equal moments of inertia\n")
    compare(SYMMETRIC, CENTRE + DISPLACEMENT, {**compositions, "blanes_moan_4": (100, 400, 1600)})
    print("\nThree different moments of inertia; the reference is a run of exudyn\n")
    _, reference, _ = of_exudyn(DIFFERENT, "RK67", 40000)(1)
    compare(DIFFERENT, reference, compositions)


if __name__ == "__main__":
    main()
