"""The heavy top from Python compared with heyoka: warm run times to an error of the centre of mass at t = 2.

    python benchmarks/heavy_top_against_heyoka.py

Needs heyoka in addition to herglotz. heyoka integrates unit quaternions and the angular velocity in the body by Taylor series,
without projection. The top is that of Bruels and Cardona (2010), without drag. Both libraries run a list of settings; the fastest
within the error is taken, and both are run in turn. The reference is a run of heyoka with its smallest tolerance.
"""

import herglotz as hz
import heyoka as hy
import numpy as np
from against_heyoka import beside, cheapest

MASS, GRAVITY, CENTRE = 15.0, 9.81, np.array([0.0, 1.0, 0.0])
AT_CENTRE = np.array([0.234375, 0.46875, 0.234375])
# About the fixed point.
MOMENTS = AT_CENTRE + MASS * np.array([1.0, 0.0, 1.0])
OMEGA = np.array([0.0, 150.0, -4.61538])
END = 2.0
LEVELS = [1e-6, 1e-9, 1e-12]
BOUND = 0.5


def of_heyoka(tolerance):
    w, x, y, z, a, b, c = variables = hy.make_vars("w", "x", "y", "z", "a", "b", "c")
    i, j, k = MOMENTS
    # The weight in the body, m g R^T (0, 0, -1), and its torque about the fixed point, with the centre on the second axis.
    down = [-2.0 * (x * z - w * y), -2.0 * (y * z + w * x), -(w * w - x * x - y * y + z * z)]
    weight = [MASS * GRAVITY * d for d in down]
    rates = [
        0.5 * (-x * a - y * b - z * c),
        0.5 * (w * a + y * c - z * b),
        0.5 * (w * b + z * a - x * c),
        0.5 * (w * c + x * b - y * a),
        ((j - k) * b * c + weight[2]) / i,
        (k - i) * c * a / j,
        ((i - j) * a * b - weight[0]) / k,
    ]
    start = np.array([1.0, 0.0, 0.0, 0.0, *OMEGA])
    integrator = hy.taylor_adaptive(list(zip(variables, rates)), start.tolist(), tol=tolerance)

    def run():
        integrator.time = 0.0
        integrator.state[:] = start
        integrator.propagate_until(END)
        w, x, y, z = integrator.state[:4]
        return np.array([2 * (x * y - w * z), w * w - x * x + y * y - z * z, 2 * (y * z + w * x)])

    return run


def of_herglotz(integrator, steps):
    top = {"inertia": AT_CENTRE, "mass": MASS, "centre": CENTRE, "gravity": (0.0, 0.0, -GRAVITY), "omega": OMEGA}

    def run():
        return hz.rigid_body(**top, t=END, integrator=integrator, steps=steps).end.tip[0]

    return run


def main():
    reference = of_heyoka(1e-18)()
    theirs = [(f"tol={tol:.0e}", of_heyoka(tol)) for tol in 10.0 ** -np.arange(4, 18)]
    schemes = ("strang", "blanes_moan_4", "kahan_li_6", "kahan_li_8", "sofroniou_spaletta_10")
    ours = [
        (f"{name}, {steps} steps", of_herglotz(name, steps))
        for name in schemes
        if name in hz.integrators()
        for steps in np.unique(np.geomspace(8, 4096, 28).astype(int)).tolist()
    ]
    for level in LEVELS:
        their, our = cheapest(theirs, reference, level), cheapest(ours, reference, level)
        if their is None or our is None:
            print(f"{level:.0e}: no run reaches it, for", "heyoka" if their is None else "herglotz")
            continue
        of_theirs, of_ours, ratio = beside(their[2], our[2])
        print(
            f"heavy top, {level:.0e}: heyoka {of_theirs * 1e6:.0f} us ({their[1]}), herglotz {of_ours * 1e6:.0f} us "
            f"({our[1]}): {ratio:.2f}, of at most {BOUND}"
        )


if __name__ == "__main__":
    main()
