"""Pendula with drag by heyoka's Taylor method, in batches of the SIMD width and one by one, at several tolerances.

Reads one number per line: the coefficient gamma of the drag, then the number of neighbours and their final time.
Writes one line per run: the problem, `batches` or `singles`, the tolerance, the seconds per member, and the largest
error at the end.
"""

import sys
import time

import heyoka as hy
import numpy as np

gamma, count, end = [float(line) for line in sys.stdin]
x, v = hy.make_vars("x", "v")
EQUATIONS = [(x, v), (v, -hy.sin(x) + gamma * v)]
WIDTH = hy.recommended_simd_size()
EXACT = 1e-18


def batches(start, end, tolerance):
    integrator = hy.taylor_adaptive_batch(EQUATIONS, np.zeros((2, WIDTH)), tol=tolerance)
    ends, state = np.empty_like(start), integrator.state
    clock = time.perf_counter()
    for i in range(0, start.shape[1], WIDTH):
        integrator.set_time(0.0)
        state[:] = start[:, i : i + WIDTH]
        integrator.propagate_until(end)
        ends[:, i : i + WIDTH] = state
    return ends, time.perf_counter() - clock


def singles(start, end, tolerance):
    integrator = hy.taylor_adaptive(EQUATIONS, [0.0, 0.0], tol=tolerance)
    ends, state = np.empty_like(start), integrator.state
    clock = time.perf_counter()
    for i in range(start.shape[1]):
        integrator.time = 0.0
        state[:] = start[:, i]
        integrator.propagate_until(end)
        ends[:, i] = state
    return ends, time.perf_counter() - clock


def measure(what, ways, start, end, tolerances, relative):
    exact = batches(start, end, EXACT)[0]
    size = np.hypot(*exact) if relative else 1.0
    for way in ways:
        for tolerance in tolerances:
            runs = [way(start, end, tolerance) for _ in range(3)]
            error = float(np.max(np.hypot(*(runs[0][0] - exact)) / size))
            seconds = min(seconds for _, seconds in runs) / start.shape[1]
            print(what, way.__name__, repr(tolerance), repr(seconds), repr(error))


# Problem P5: the grid of `grid` in ensembles.rs.
grid = np.array([a.ravel() for a in np.meshgrid(np.linspace(-2, 2, 400), np.linspace(-1, 1, 250), indexing="ij")])
measure("pendula", [batches], grid, 10.0, [1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13], False)
# Neighbours of problem P2: a subset that is large enough to be timed.
part = 25 * WIDTH
neighbours = np.array([1 + 1e-6 * (count / part) * np.arange(part), np.ones(part)])
measure("neighbours", [batches, singles], neighbours, end, [1e-8, 1e-9, 1e-10, 1e-11, 1e-12], True)
