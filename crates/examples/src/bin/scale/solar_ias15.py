"""The outer solar system with linear drag by REBOUND's IAS15; the force of the drag is compiled from C.

Reads one number per line: G, the coefficient of the drag, the final time, then mass, position and velocity of each
body. Writes one line per tolerance: the tolerance, the shorter of two run times in seconds, and the final positions.
"""

import ctypes
import pathlib
import subprocess
import sys
import tempfile
import time

import rebound

DRAG = """
#include "rebound.h"
double gamma_;
void drag(struct reb_simulation *r) {
    for (size_t i = 0; i < r->N; i++) {
        struct reb_particle *p = &r->particles[i];
        p->ax += gamma_ * p->vx; p->ay += gamma_ * p->vy; p->az += gamma_ * p->vz;
    }
}
"""

numbers = [float(line) for line in sys.stdin]
g, gamma, end = numbers[:3]
bodies = [numbers[i : i + 7] for i in range(3, len(numbers), 7)]
with tempfile.TemporaryDirectory() as folder:
    source, library = pathlib.Path(folder) / "drag.c", pathlib.Path(folder) / "drag.so"
    source.write_text(DRAG)
    package = pathlib.Path(rebound.__file__).parent
    include = next(p.parent for root in (package, package.parent) for p in root.rglob("rebound.h"))
    subprocess.run(["cc", "-O3", "-march=native", "-shared", "-fPIC", f"-I{include}", "-o", library, source], check=True)
    drag = ctypes.CDLL(str(library))
    ctypes.c_double.in_dll(drag, "gamma_").value = gamma
    for epsilon in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9):
        best = float("inf")
        for _ in range(2):
            sim = rebound.Simulation()
            sim.G = g
            sim.integrator = "ias15"
            sim.integrator.epsilon = epsilon
            for m, x, y, z, vx, vy, vz in bodies:
                sim.add(m=m, x=x, y=y, z=z, vx=vx, vy=vy, vz=vz)
            sim.dt = 10.0
            if gamma != 0.0:
                sim.additional_forces = ctypes.cast(drag.drag, type(sim._additional_forces))
                sim.force_is_velocity_dependent = 1
            clock = time.perf_counter()
            sim.integrate(end)
            best = min(best, time.perf_counter() - clock)
        positions = [x for p in sim.particles for x in (p.x, p.y, p.z)]
        print(*[repr(x) for x in (epsilon, best, *positions)])
