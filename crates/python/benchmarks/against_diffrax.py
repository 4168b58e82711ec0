"""The value and the gradient of the end of a motion from Python, compared with diffrax and diffsol: warm run times.

    python benchmarks/against_diffrax.py [CSV]

Needs JAX and diffrax in addition to herglotz, and measures diffsol where `diffsol-jax` is installed. The motion is

    P2   v^2/2 - 1 + cos q + gamma z      q = 1, v = 1, z = 0, gamma = -0.01   T = 100

and the number q(T), with its gradient in q(0), v(0) and gamma. The error is the largest relative one of the three
derivatives. Every library runs a list of settings, and the fastest setting within a bound of the error counts: diffrax
Tsit5 and Dopri8, by `RecursiveCheckpointAdjoint` with as many steps as the run takes, and by `ForwardMode`; diffsol its
four methods, whose derivatives are forward ones. All functions are compiled before they are measured. The runs of two
libraries alternate, so that changes of the clock frequency cancel in the ratio. The rows of all settings are written
to CSV (by default against_diffrax.csv).
"""

import csv
import sys

import jax
import jax.numpy as jnp
import numpy as np
from against_heyoka import beside, median

jax.config.update("jax_enable_x64", True)

END = 100.0
START = np.array([1.0, 1.0, -0.01])  # q, v, gamma
# The figures of tests/gradients/pendulum.rs, to the digits given.
VALUE = -0.591939247134
GRADIENT = np.array([5.65210486970, 7.38154595869, 225.145071391822])
LEVELS = (1e-4, 1e-6, 1e-8, 1e-10)
# The largest ratio of the times, of herglotz to each of the others.
BOUNDS = {"diffrax": 1 / 50, "diffsol": 1 / 10}


def error(found):
    value, gradient = found
    return max(abs(float(value) / VALUE - 1), *np.abs(np.asarray(gradient) / GRADIENT - 1))


def field(t, y, p):
    q, v, z = y
    return v, -jnp.sin(q) + p * v, v * v / 2 - 1 + jnp.cos(q) + p * z


def of_herglotz():
    """The settings, and a function for each that returns value and gradient."""
    import herglotz as hz

    system = hz.system("x'^2/2 - 1 + cos(x) + gamma*z", coordinates=["x"], parameters={"gamma": START[2]})
    end = hz.value_and_grad("x")

    def run(integrator, steps):
        value, slopes = end(system, START[:1], START[1:2], END, integrator=integrator, steps=steps)
        return value, (slopes.q0[0], slopes.v0[0], slopes.parameters["gamma"])

    for stages in (4, 6, 8, 10, 12, 14, 16):
        for steps in np.unique(np.round(END / np.geomspace(0.4, 5.0, 12))).astype(int):
            yield f"gauss_{stages}", f"steps={steps}", lambda s=f"gauss_{stages}", n=int(steps): run(s, n)


def of_diffrax():
    import diffrax as dx

    def solution(solver, adjoint, most, x, tolerance):
        term = dx.ODETerm(field)
        y0 = x[0], x[1], jnp.zeros(())
        control = dx.PIDController(rtol=tolerance, atol=tolerance)
        return dx.diffeqsolve(
            term, solver, 0.0, END, None, y0, args=x[2], stepsize_controller=control, adjoint=adjoint, max_steps=most
        )

    for solver in (dx.Tsit5(), dx.Dopri8()):
        count = jax.jit(
            lambda x, tol, s=solver: solution(s, dx.RecursiveCheckpointAdjoint(), 2**17, x, tol).stats["num_steps"]
        )
        for tolerance in 10.0 ** -np.arange(4, 14):
            # More checkpoints than the steps need cost time.
            most = int(count(START, tolerance))
            for adjoint in (dx.RecursiveCheckpointAdjoint(), dx.ForwardMode()):
                end = lambda x, s=solver, a=adjoint, m=most, tol=tolerance: solution(s, a, m, x, tol).ys[0][-1]
                if isinstance(adjoint, dx.ForwardMode):
                    both = lambda x, end=end: (end(x), jax.jacfwd(end)(x))
                else:
                    both = jax.value_and_grad(end)
                compiled = jax.jit(both)
                name = f"{type(solver).__name__}, {type(adjoint).__name__}"
                yield (
                    name,
                    f"tolerance={tolerance:.0e}, steps={most}",
                    lambda f=compiled: jax.block_until_ready(f(START)),
                )


def of_diffsol():
    from diffsol_jax import ODEProblem

    # diffsol-jax has derivatives in parameters only: the state is counted from its start, which is one of them.
    def shifted(t, y, p):
        return field(t, (y[0] + p[0], y[1] + p[1], y[2]), p[2])

    problem = ODEProblem(shifted, y0=jnp.zeros(3), params=jnp.array(START))
    times = jnp.array([END])
    for method in ("tsit45", "bdf", "esdirk34", "tr_bdf2"):
        for tolerance in 10.0 ** -np.arange(4, 14):

            def end(p, method=method, tol=float(tolerance)):
                return problem.solve(p, times, ode_solver=method, rtol=tol, atol=tol)[1][-1, 0] + p[0]

            compiled = jax.jit(jax.value_and_grad(end))
            yield method, f"tolerance={tolerance:.0e}", lambda f=compiled: jax.block_until_ready(f(jnp.array(START)))


def measured(library, settings):
    """The settings of a library: its error, and its median time where the error is of interest."""
    rows = []
    for method, setting, run in settings:
        try:
            found = error(run())
        except Exception as cause:  # A run that fails has a type of its own in each library.
            print(f"{library}, {method}, {setting}: {str(cause).strip().splitlines()[-1]}")
            continue
        seconds = median(run, least=0.1) if found <= max(LEVELS) else float("nan")
        rows.append((library, method, setting, found, seconds, run))
    return rows


def main():
    rows = measured("herglotz", of_herglotz())
    for library, settings in (("diffrax", of_diffrax), ("diffsol", of_diffsol)):
        try:
            rows += measured(library, settings())
        except ImportError as cause:
            print(f"{library}: not measured, {cause}")
    with open(sys.argv[1] if len(sys.argv) > 1 else "against_diffrax.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["library", "method", "setting", "error", "seconds"])
        writer.writerows(row[:5] for row in rows)
    for level in LEVELS:
        best = {}
        for library, method, setting, found, seconds, run in rows:
            if found <= level and seconds < best.get(library, (np.inf,))[0]:
                best[library] = seconds, f"{method}, {setting}, error {found:.0e}", run
        for library in BOUNDS:
            if "herglotz" not in best or library not in best:
                print(f"{level:.0e}: {library}: no setting reaches it")
                continue
            theirs, ours, ratio = beside(best[library][2], best["herglotz"][2])
            print(
                f"{level:.0e}: {library} {theirs * 1e3:.3f} ms ({best[library][1]}), "
                f"herglotz {ours * 1e3:.3f} ms ({best['herglotz'][1]}): 1/{1 / ratio:.0f}, of at most 1/{1 / BOUNDS[library]:.0f}"
            )


if __name__ == "__main__":
    main()
