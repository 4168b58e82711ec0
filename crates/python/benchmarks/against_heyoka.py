"""Motions from Python compared with heyoka: warm and cold run times, call overhead, import time, size of the wheel.

    python benchmarks/against_heyoka.py [--short] [WHEEL]

Needs heyoka in addition to herglotz; with `--short`, all of the package's own part runs once, with heyoka or without. The motions are (T is the final time, z is integrated along):

    P2   v^2/2 - 1 + cos q - 0.01 z      q = 1, v = 1   T = 1000
    P6   v^2/2 - q^2/2 - 0.05 z^2        q = 1, v = 0, z = 1   T = 100

A call by an accuracy is `herglotz.solve` as users type it, search for the steps included, beside the fastest run of
heyoka with this error and the same steps given. Cold is the time from the definition to the end of the first run: once with a requested accuracy, for which trial runs
find the step, and once with given steps that reach it. Warm is the fastest way to an error of (q, v) at the end,
relative to its size there; both libraries run a list of settings. The reference is a run of heyoka with its smallest
tolerance.
"""

import os
import subprocess
import sys
import time

import numpy as np

PROBLEMS = {
    "P2": dict(
        start=([1.0], [1.0], 0.0),
        end=1000.0,
        levels={1e-9: 0.4, 1e-12: 0.4},
        steps=dict(integrator="gauss_16", steps=300),
    ),
    "P6": dict(start=([1.0], [0.0], 1.0), end=100.0, levels={1e-9: 0.6}, steps=dict(integrator="gauss_8", steps=60)),
}


SHORT = "--short" in sys.argv


def has_heyoka():
    try:
        import heyoka  # noqa: F401
    except ImportError:
        return False
    return True


def lagrangian(name):
    return {
        "P2": lambda t, q, v, z: v @ v / 2 - 1 + np.cos(q[0]) - 0.01 * z,
        "P6": lambda t, q, v, z: v @ v / 2 - q @ q / 2 - 0.05 * z * z,
    }[name]


def equations(name, hy):
    q, v, z = hy.make_vars("q", "v", "z")
    if name == "P2":
        return [(q, v), (v, -hy.sin(q) - 0.01 * v), (z, v * v / 2.0 - 1.0 + hy.cos(q) - 0.01 * z)]
    return [(q, v), (v, -q - 0.1 * z * v), (z, v * v / 2.0 - q * q / 2.0 - 0.05 * z * z)]


def median(run, least=0.0 if SHORT else 0.3):
    times, run_until = [], time.perf_counter() + least
    while time.perf_counter() < run_until or len(times) < 7:
        begin = time.perf_counter()
        run()
        times.append(time.perf_counter() - begin)
    return float(np.median(times))


def of_heyoka(name, tolerance):
    import heyoka as hy

    q, v, z = PROBLEMS[name]["start"]
    state, end = np.array([*q, *v, z]), PROBLEMS[name]["end"]
    integrator = hy.taylor_adaptive(equations(name, hy), state.tolist(), tol=tolerance)

    def run():
        integrator.time = 0.0
        integrator.state[:] = state
        integrator.propagate_until(end)
        return integrator.state[:2].copy()

    return run


def of_herglotz(name, integrator, steps):
    import herglotz as hz

    q, v, z = PROBLEMS[name]["start"]
    system = hz.system(lagrangian(name), n=1)

    def run():
        sol = hz.solve(system, q, v, PROBLEMS[name]["end"], z0=z, integrator=integrator, steps=steps)
        return np.array([sol.q[-1, 0], sol.v[-1, 0]])

    return run


def cheapest(runs, reference, level):
    """The fastest of the runs whose error is within a bound: its median time, its settings, and the run."""
    best = None
    for settings, run in runs:
        found = run()
        if np.linalg.norm(found - reference) <= level * np.linalg.norm(reference):
            seconds = median(run)
            if best is None or seconds < best[0]:
                best = seconds, settings, run
    return best


def beside(their, our, rounds=25):
    """The median times of two alternating runs, and of their ratio, insensitive to changes of clock frequency."""
    times = np.array([[median(run, least=0.02) for run in (their, our)] for _ in range(rounds)])
    return *np.median(times, axis=0), float(np.median(times[:, 1] / times[:, 0]))


def warm():
    for name, problem in PROBLEMS.items():
        reference = of_heyoka(name, 1e-28 if name == "P2" else 1e-18)()
        theirs = [(f"tol={tol:.0e}", of_heyoka(name, tol)) for tol in 10.0 ** -np.arange(6, 19)]
        end = problem["end"]
        ours = [
            (f"gauss_{stages}, {steps} steps", of_herglotz(name, f"gauss_{stages}", int(steps)))
            for stages in (6, 8, 10, 12, 14, 16)
            for steps in np.unique(np.round(end / np.linspace(0.8, 5.0, 15)))
        ]
        for level, bound in problem["levels"].items():
            their, our = cheapest(theirs, reference, level), cheapest(ours, reference, level)
            if their is None or our is None:
                print(f"{name} warm, {level:.0e}: no run reaches it, for", "heyoka" if their is None else "herglotz")
                continue
            of_theirs, of_ours, ratio = beside(their[2], our[2])
            print(
                f"{name} warm, {level:.0e}: heyoka {of_theirs * 1e6:.0f} us ({their[1]}), herglotz {of_ours * 1e6:.0f} us "
                f"({our[1]}): {ratio:.2f}, of at most {bound}"
            )


def calls():
    import herglotz as hz

    for name, problem in PROBLEMS.items():
        q, v, z = problem["start"]
        system = hz.system(lagrangian(name), n=1)
        other = has_heyoka()
        if other:
            reference = of_heyoka(name, 1e-28 if name == "P2" else 1e-18)()
            theirs = [(f"tol={tol:.0e}", of_heyoka(name, tol)) for tol in 10.0 ** -np.arange(3, 19)]
        for level in (1e-9,) if SHORT else (1e-3, 1e-6, 1e-9, 1e-12):
            call = lambda: hz.solve(system, q, v, problem["end"], z0=z, accuracy=level)
            sol = call()
            given = of_herglotz(name, sol.plan.integrator, sol.plan.steps)
            text = f"{name} by accuracy={level:.0e}: {median(call) * 1e6:.0f} us, its {sol.plan.steps} steps given {median(given) * 1e6:.0f} us"
            if other:
                found = np.array([sol.q[-1, 0], sol.v[-1, 0]])
                error = np.linalg.norm(found - reference) / np.linalg.norm(reference)
                their = cheapest(theirs, reference, level)
                text += f", error {error:.0e}; heyoka {their[0] * 1e6:.0f} us ({their[1]})"
            print(text)


COLD_HEYOKA = """
import sys, time, numpy as np, heyoka as hy
sys.path.insert(0, {folder!r})
from against_heyoka import *
begin = time.perf_counter()
of_heyoka({name!r}, 1e-13)()
print(time.perf_counter() - begin)
"""

COLD_HERGLOTZ = """
import sys, time, numpy as np, herglotz as hz
sys.path.insert(0, {folder!r})
from against_heyoka import *
q, v, z = PROBLEMS[{name!r}]["start"]
begin = time.perf_counter()
hz.solve(lagrangian({name!r}), q, v, PROBLEMS[{name!r}]["end"], z0=z, **{way!r})
print(time.perf_counter() - begin)
"""

IMPORT = """
import time
begin = time.perf_counter()
import numpy
middle = time.perf_counter()
import herglotz
print(time.perf_counter() - middle)
"""


def in_a_process(code, count=1 if SHORT else 5):
    """The median of the numbers that a program prints, each in a process of its own."""
    found = [
        float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)
        for _ in range(count)
    ]
    return float(np.median(found))


def cold():
    folder = os.path.dirname(os.path.abspath(__file__))
    for name in PROBLEMS:
        their = in_a_process(COLD_HEYOKA.format(folder=folder, name=name)) if has_heyoka() else None
        for way in (dict(accuracy=1e-9), PROBLEMS[name]["steps"]):
            our = in_a_process(COLD_HERGLOTZ.format(folder=folder, name=name, way=way))
            by = ", ".join(f"{key}={value}" for key, value in way.items())
            ratio = f"; heyoka {their * 1e3:.1f} ms: {our / their:.3f}, of at most 0.05" if their else ""
            print(f"{name} cold, {by}: herglotz {our * 1e3:.2f} ms{ratio}")


def overhead():
    """The time of a call of `solve` with one step, minus that of the run itself."""
    import herglotz as hz
    from herglotz import _core

    system = hz.system(lagrangian("P2"), n=1)
    request = ([1.0], [1.0], False, 0.0, None), 0.1, None, (None, "strang", None, 1), [], [], False, False, None
    motion = _core.Motion(system, *request)
    run = median(lambda: [_core.run(motion) for _ in range(100)]) / 100
    for what, L in (("a system", system), ("a function", lagrangian("P2"))):
        call = lambda: hz.solve(L, [1.0], [1.0], 0.1, integrator="strang", steps=1)
        whole = median(lambda: [call() for _ in range(100)]) / 100
        print(
            f"overhead of solve of {what}: {(whole - run) * 1e6:.1f} us, of at most 20; its run of one step {run * 1e6:.1f} us"
        )


def main():
    if has_heyoka() and not SHORT:
        warm()
    calls()
    cold()
    overhead()
    print(f"import after numpy: {in_a_process(IMPORT) * 1e3:.1f} ms, of at most 50")
    for wheel in sys.argv[1:]:
        if wheel != "--short":
            print(f"wheel: {os.path.getsize(wheel) / 1e6:.1f} MB, of at most 12")


if __name__ == "__main__":
    main()
