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
from ._core import catalogue as _catalogue
from ._core import integrators as _integrators
from ._ensemble import Ensemble, MemberCrossings, ensemble
from ._exact import DiscreteLagrangian, Exponential, Retraction, exact_lagrangian, exponential, retract
from ._looks import Check, Comparison, Contact, Geometry, check, compare, geometry, is_contact
from ._solution import Crossings, Interrupted, Plan, Solution, States
from ._solve import Event, solve
from ._system import system
from ._trace import array, where

__version__ = "0.1.0"


def integrators():
    """The names of all integrators with their orders: a dict."""
    return dict(_integrators())


def catalogue():
    """The systems that are known by name, with what they are: a dict."""
    return {name: about for name, about, *_ in _catalogue()}


__all__ = [
    "Check",
    "Comparison",
    "Contact",
    "Crossings",
    "DiscreteLagrangian",
    "Ensemble",
    "Event",
    "Exponential",
    "Geometry",
    "Interrupted",
    "MemberCrossings",
    "Plan",
    "Retraction",
    "Solution",
    "States",
    "System",
    "array",
    "catalogue",
    "check",
    "compare",
    "ensemble",
    "exact_lagrangian",
    "exponential",
    "geometry",
    "integrators",
    "is_contact",
    "retract",
    "solve",
    "system",
    "where",
]
