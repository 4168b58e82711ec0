"""Motions of contact Lagrangian systems.

A Lagrangian L(t, q, v, z) that depends on its own action z has friction in it: Herglotz' equation,

    d/dt L_v = L_q + L_z L_v,   dz/dt = L.

`solve` integrates it by contact integrators:

>>> import numpy as np, herglotz as hz
>>> def L(t, q, v, z):
...     return v @ v / 2 + np.cos(q[0]) - 0.1 * z
>>> sol = hz.solve(L, q0=[1.0], v0=[0.0], t=np.linspace(0, 100, 1001), accuracy=1e-10)
>>> sol.q.shape, sol.status
((1001, 1), 'completed')
"""

from ._core import System
from ._solution import Crossings, Interrupted, Plan, Solution
from ._solve import Event, solve
from ._system import system
from ._trace import array, where

__all__ = ["Crossings", "Event", "Interrupted", "Plan", "Solution", "System", "array", "solve", "system", "where"]
