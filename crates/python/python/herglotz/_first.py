"""The first motions of a process, computed as the package is loaded.

They bring the code that motions run through into memory, and make the tables of coefficients that most of them use. The first
motion of the user would else take up to half a millisecond longer than all others.
"""

import numpy as np

from ._solve import solve


def compute():
    """One motion by each of the routes that are taken where no integrator is named: the one to an accuracy, as that finds its steps."""
    solve(lambda t, q, v, z: v @ v / 2 + np.cos(q[0]) - z, [0.5], [0.0], 2.0, integrator="gauss_16", steps=2)
    solve(lambda t, q, v, z: v @ v / 2 - q @ q / 2 - z * z / 8, [0.5], [0.0], 2.0, accuracy=1e-9)
