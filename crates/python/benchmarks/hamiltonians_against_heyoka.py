"""Contact Hamiltonians from Python compared with heyoka: warm run times to an error of (q, p) at the end.

    python benchmarks/hamiltonians_against_heyoka.py [PROBLEM ...]

Needs heyoka in addition to herglotz. heyoka integrates the equations `q' = H_p`, `p' = -H_q - p H_z`, `z' = p . H_p - H`, which it
derives from the same H. The problems are those of the scenes of these names (T is the final time):

    van_der_pol   linear in p   T = 8
    containers    linear in p, four coordinates   T = 5
    spin_orbit    depends on time   T = 100
    thermostat    exponential in p   T = 3

Both libraries run a list of settings; the fastest within the error is taken, and both are run in turn. The reference is a run of heyoka
with its smallest tolerance.
"""

import sys

import herglotz as hz
import heyoka as hy
import numpy as np
from against_heyoka import beside, cheapest


def energy(q, s, of):
    """The energy of a gas of volume q and entropy s, with the exponential function of a library."""
    return 2 * q ** (-2.0 / 3.0) * of.exp(2.0 * s / 3.0)


def van_der_pol(t, q, p, z, of):
    return p[0] * q[1] + p[1] * ((1 - q[0] * q[0]) * q[1] - q[0]) + z


def containers(t, q, p, z, of):
    e1, e2 = energy(q[0], q[2], of), energy(2 - q[0], q[3], of)
    t1, t2 = 2 * e1 / 3, 2 * e2 / 3
    flow = 0.5 * (1 / t1 - 1 / t2)
    return p[0] * q[1] + p[1] * (t1 / q[0] - t2 / (2 - q[0])) + flow * (p[2] / t1 - p[3] / t2)


def spin_orbit(t, q, p, z, of):
    inertia = 1 + 1e-4 * of.cos(t)
    harmonics = [-0.00499993750130206, 0.9997500081248785, 0.03499231288202264, 0.0008498083458536453]
    tide = sum(h * of.cos(2 * q[0] - (k + 1) * t) for k, h in enumerate(harmonics))
    return p[0] * p[0] / 2 - 1e-3 * q[0] + (1e-3 - 1e-4 * of.sin(t) / inertia) * z - 0.0075 / (2 * inertia) * tide


def thermostat(t, q, p, z, of):
    return of.exp(0.05 * (p[0] * p[0] / 2 + 2 * q[0] * q[0])) * (of.exp(z / 4) + of.exp(-z / 4)) * 2**0.5


# H, the start, the end and the accepted ratios for an error.
PROBLEMS = {
    "van_der_pol": (van_der_pol, ([2.0, 0.0], [1.0, 0.5], 0.0), 8.0),
    "containers": (containers, ([1.0, 2.0, 0.0, 0.0], [0.0] * 4, 0.0), 5.0),
    "spin_orbit": (spin_orbit, ([2.7], [3.0], 0.0), 100.0),
    "thermostat": (thermostat, ([0.12578471404894542], [0.7479637648489665], -0.917435858684718), 3.0),
}
LEVELS = [1e-6, 1e-9, 1e-12]
BOUND = 0.5


def of_heyoka(name, tolerance):
    h, (q0, p0, z0), end = PROBLEMS[name]
    n = len(q0)
    q, p = ([hy.make_vars(f"{letter}{i}") for i in range(n)] for letter in "qp")
    z = hy.make_vars("z")
    value = h(hy.time, q, p, z, hy) + 0.0 * z
    rates = [hy.diff(value, x) for x in p]
    factor = hy.diff(value, z)
    equations = [
        *zip(q, rates),
        *((y, -hy.diff(value, x) - y * factor) for x, y in zip(q, p)),
        (z, sum(y * rate for y, rate in zip(p, rates)) - value),
    ]
    state = np.array([*q0, *p0, z0])
    integrator = hy.taylor_adaptive(equations, state.tolist(), tol=tolerance)

    def run():
        integrator.time = 0.0
        integrator.state[:] = state
        integrator.propagate_until(end)
        return integrator.state[: 2 * n].copy()

    return run


def of_herglotz(name, integrator, steps):
    h, (q0, p0, z0), end = PROBLEMS[name]
    system = hz.system(H=lambda t, q, p, z: h(t, q, p, z, np), n=len(q0))

    def run():
        sol = hz.solve(system, q0, p0=p0, t=end, z0=z0, integrator=integrator, steps=steps)
        # Steps that are too long fail.
        return np.array([*sol.q[-1], *sol.p[-1]]) if sol.success else np.full(2 * len(q0), np.inf)

    return run


def settings_of(name):
    end = PROBLEMS[name][2]
    for stages in (4, 6, 8, 10, 12, 16):
        for step in np.geomspace(0.02, 1.6, 12) if name != "thermostat" else np.geomspace(0.001, 0.1, 12):
            steps = int(np.ceil(end / step))
            yield f"gauss_{stages}, {steps} steps", of_herglotz(name, f"gauss_{stages}", steps)


def main(names):
    for name in names or PROBLEMS:
        reference = of_heyoka(name, 1e-18)()
        theirs = [(f"tol={tol:.0e}", of_heyoka(name, tol)) for tol in 10.0 ** -np.arange(4, 18)]
        ours = list(settings_of(name))
        for level in LEVELS:
            their, our = cheapest(theirs, reference, level), cheapest(ours, reference, level)
            if their is None or our is None:
                print(f"{name}, {level:.0e}: no run reaches it, for", "heyoka" if their is None else "herglotz")
                continue
            of_theirs, of_ours, ratio = beside(their[2], our[2])
            print(
                f"{name}, {level:.0e}: heyoka {of_theirs * 1e6:.0f} us ({their[1]}), herglotz {of_ours * 1e6:.0f} us "
                f"({our[1]}): {ratio:.2f}, of at most {BOUND}"
            )


if __name__ == "__main__":
    main(sys.argv[1:])
