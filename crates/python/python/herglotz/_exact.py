"""The exact discrete Lagrangian and the contact exponential map, in one to eight coordinates."""

from typing import NamedTuple

import numpy as np

from . import _core
from ._system import check_used, system_of


class Exponential(NamedTuple):
    """The position after a time h, and the regularity of the contact exponential map."""

    q1: np.ndarray  # (n,)
    regularity: float  # the smallest singular value of dq1/dv0


class Retraction(NamedTuple):
    """The motion between two points."""

    v0: np.ndarray  # (n,)
    v1: np.ndarray  # (n,)
    z1: float
    action: float
    sigma: float


class DiscreteLagrangian(NamedTuple):
    """The exact discrete Lagrangian at two points, with its derivatives with respect to q0, q1 and z0."""

    value: float
    d1: np.ndarray  # (n,)
    d2: np.ndarray  # (n,)
    dz: float
    sigma: float


def exponential(L, h, q0, v0, z0=0.0, t=0.0, *, coordinates=None, parameters=None):
    """The contact exponential map (q0, v0, z0) -> (q0, q1, z0): the position after a time h.

    Parameters
    ----------
    L, coordinates, parameters
        As in `solve`, with one to eight coordinates.
    h, z0, t : float
    q0, v0 : arrays of shape (n,)

    Returns
    -------
    Exponential
    """
    of = _system(L, q0, coordinates, parameters)
    (q1,), (regularity,) = _core.exponential(of, [h, q0, v0, z0, t])
    return Exponential(np.array(q1), regularity)


def retract(L, h, q0, q1, z0=0.0, t=0.0, *, coordinates=None, parameters=None):
    """The exact retraction, the inverse of `exponential`: the motion from q0 to q1 in a time h.

    Parameters
    ----------
    L, coordinates, parameters
        As in `solve`, with one to eight coordinates.
    h, z0, t : float
    q0, q1 : arrays of shape (n,)

    Returns
    -------
    Retraction
    """
    of = _system(L, q0, coordinates, parameters)
    (v0, v1), (z1, action, sigma) = _core.retract(of, [h, q0, q1, z0, t])
    return Retraction(np.array(v0), np.array(v1), z1, action, sigma)


def exact_lagrangian(L, h, q0, q1, z0=0.0, t=0.0, *, coordinates=None, parameters=None):
    """The exact discrete Lagrangian L_h(q0, q1, z0), the action z(h) - z0 along the motion from q0 to q1.

    Parameters
    ----------
    L, coordinates, parameters
        As in `solve`, with one to eight coordinates.
    h, z0, t : float
    q0, q1 : arrays of shape (n,)

    Returns
    -------
    DiscreteLagrangian
    """
    of = _system(L, q0, coordinates, parameters)
    (d1, d2), (value, dz, sigma) = _core.exact_lagrangian(of, [h, q0, q1, z0, t])
    return DiscreteLagrangian(value, np.array(d1), np.array(d2), dz, sigma)


def _system(L, q0, coordinates, parameters):
    of = system_of(L, coordinates, parameters, n=np.size(q0))
    check_used(of, parameters, None, (L,), ())
    return of
