"""Motions of contact Lagrangian systems.

A Lagrangian L(t, q, v, z) that depends on its own action z describes dissipation. Its motions satisfy Herglotz'
equation,

    d/dt L_v = L_q + L_z L_v,   dz/dt = L.

`solve` integrates it with contact integrators:

>>> import numpy as np, herglotz as hz
>>> def L(t, q, v, z):
...     return v @ v / 2 + np.cos(q[0]) - 0.1 * z
>>> sol = hz.solve(L, q0=[1.0], v0=[0.0], t=np.linspace(0, 100, 1001), accuracy=1e-10)
>>> sol.q.shape, sol.status
((1001, 1), 'completed')
"""

from importlib import import_module as _import_module

from . import _processor  # noqa: F401
from ._additions import table
from ._core import System, Table
from ._core import catalogue as _catalogue
from ._core import integrators as _integrators
from ._events import Event
from ._solution import Crossings, Interrupted, Plan, Resets, Solution, States
from ._solve import solve
from ._system import system
from ._trace import array, where

__version__ = "0.1.0"

# Modules that a single motion does not need are loaded at first use: they are half of the import time.
_LATER = {
    "_body_derivatives": "RigidBodySensitivity",
    "_body": "RigidBody RigidBodyDerivatives RigidBodySolution RigidBodyStates body rigid_bodies rigid_body rigid_body_between",
    "_sparse": "SparseSolution SparseSystem bodies lattice",
    "_ensemble": "Ensemble MemberCrossings MemberResets ensemble",
    "_exact": "DiscreteLagrangian Exponential Retraction exact_lagrangian exponential retract",
    "_fit": "Fit fit",
    "_path": "Path path",
    "_scene": "run",
    "_ensemble_derivatives": "EnsembleGradient EnsembleSensitivity ensemble_value_and_grad",
    "_method": "Method method",
    "_sensitivity": "EndSensitivity Gradient LyapunovExponents Sensitivity value_and_grad",
    "_checks": "Check Comparison Contact Geometry HamiltonianGeometry check compare geometry is_contact",
}
_LATER = {name: module for module, names in _LATER.items() for name in names.split()}


def __getattr__(name):
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = getattr(_import_module(f".{_LATER[name]}", __name__), name)
    globals()[name] = found
    return found


def __dir__():
    return sorted({*globals(), *_LATER})


def integrators():
    """The names of all integrators with their orders, as a dict."""
    return dict(_integrators())


def catalogue():
    """The names of all systems of the catalogue with a short description, as a dict."""
    return {name: about for name, about, *_ in _catalogue()}


__all__ = [
    "SparseSolution",
    "SparseSystem",
    "Check",
    "Comparison",
    "Contact",
    "Crossings",
    "DiscreteLagrangian",
    "EndSensitivity",
    "Ensemble",
    "EnsembleGradient",
    "EnsembleSensitivity",
    "Event",
    "Exponential",
    "Fit",
    "Geometry",
    "Gradient",
    "HamiltonianGeometry",
    "Interrupted",
    "LyapunovExponents",
    "Method",
    "MemberCrossings",
    "MemberResets",
    "Path",
    "Plan",
    "Resets",
    "Retraction",
    "RigidBody",
    "RigidBodyDerivatives",
    "RigidBodySensitivity",
    "RigidBodySolution",
    "RigidBodyStates",
    "Sensitivity",
    "Solution",
    "States",
    "System",
    "Table",
    "array",
    "bodies",
    "body",
    "catalogue",
    "check",
    "compare",
    "ensemble",
    "ensemble_value_and_grad",
    "exact_lagrangian",
    "exponential",
    "fit",
    "geometry",
    "integrators",
    "is_contact",
    "lattice",
    "method",
    "path",
    "retract",
    "rigid_bodies",
    "rigid_body",
    "rigid_body_between",
    "run",
    "solve",
    "system",
    "table",
    "value_and_grad",
    "where",
]
