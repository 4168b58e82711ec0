"""Motions between two given positions: boundary value problems."""

import numpy as np

from . import _core
from ._rows import Rows
from ._solve import functions_of, system_and_start
from ._system import Composed, check_used, copied


class Path(Rows):
    """A path of k steps between two positions; made by `path`.

    Attributes
    ----------
    t, z : arrays of shape (k + 1,)
        The times and the actions of the points of the path.
    q, p : arrays of shape (k + 1, n)
        The positions and the momenta.
    found : bool
        Whether the path satisfies its equations; otherwise it is the last path of the search.
    status : str
        How the search ended, with advice where no path was found.
    action : float
        The action of the whole path.
    residual : float
        The largest residual of a discrete Herglotz equation, in units of momentum.
    log_factor : float
        The logarithm of the conformal factor of the whole path.
    unresolved : str or None
        The reason why a path that was found may be far from every motion: its steps do not resolve the motion, as where
        it jumps over a centre of force, or its ends are conjugate to within the truncation error.
    error_estimate : float or None
        The estimated displacement of the path by the truncation error, in units of its range; for rules of order one or
        two.
    regularity : float
        The smallest pivot of the last linearised equations, relative to its size before the elimination; small where
        the ends are nearly conjugate.
    iterations : int
        The number of corrections that were made.
    """

    def __init__(self, system, t, record):
        self.system = system
        self.t, self.q, self.p, self.z = t, record.q, record.p, record.z
        self.found, self.status = record.found, record.status
        self.residual, self.log_factor, self.iterations = record.residual, record.log_factor, record.iterations
        self.unresolved, self.error_estimate, self.regularity = record.unresolved, record.error_estimate, record.regularity

    @property
    def action(self):
        return float(self.z[-1] - self.z[0])

    def _columns(self):
        names = self.system.coordinates
        columns = dict(zip(names, self.q.T)) | {f"p_{name}": p for name, p in zip(names, self.p.T)}
        return columns | {"z": self.z}

    def _arrays(self):
        data = {name: (("t", "coordinate"), getattr(self, name)) for name in ("q", "p")} | {"z": ("t", self.z)}
        attributes = {"lagrangian": self.system.lagrangian, "status": self.status}
        return data, {"coordinate": self.system.coordinates}, attributes

    def _plotted(self):
        return self.system.coordinates

    def __bool__(self):
        return self.found

    def __repr__(self):
        doubt = "" if self.unresolved is None else f"; {self.unresolved}"
        return f"<Path: {len(self.t) - 1} steps from t = {self.t[0]} to {self.t[-1]}, {self.status}{doubt}>"


def path(
    L,
    q0,
    q1,
    t,
    *,
    steps,
    integrator="gauss_4",
    z0=0.0,
    guess=None,
    coordinates=None,
    parameters=None,
    force=None,
    rayleigh=None,
    tables=None,
):
    """The motion between two positions: the path that is critical for the discrete action of Herglotz' principle.

    With a force the path satisfies the discrete equations with this force, and is critical for no action. Newton's method searches for it, starting from the straight line or from a guess; there may be several paths, or
    none.

    Parameters
    ----------
    L, coordinates, parameters
        As in `solve`, with one to eight coordinates.
    q0, q1 : arrays of shape (n,)
        The positions at the start and at the end.
    t : float or tuple (t0, t1)
        The times of start and end; a single number is the final time of a path from 0.
    steps : int
        The number of steps, all of the same length.
    integrator : str
        The integrator whose discrete action is used: a Gauss method, ``"gauss_1"`` to ``"gauss_16"``, or a quadrature
        rule such as ``"midpoint"``. With a force it is a rule.
    z0 : float
        The initial action.
    guess : array of shape (steps + 1, n), optional
        The points of the initial guess, for example those of a path over another time span. That of a rigid body, whose ends
        are attitudes, is the angular velocity at the start.
    force, rayleigh, tables
        As in `system`.

    Returns
    -------
    Path
        For a rigid body a `RigidBodySolution`, as of `rigid_body_between`.

    Raises
    ------
    ValueError
        For an invalid argument; whether a path was found is an attribute of the path.
    """
    arguments = locals()
    if isinstance(L, Composed) and hasattr(L, "_path"):
        return L._path(arguments)
    more = force, rayleigh, tables, None
    given = L, *functions_of(force, rayleigh)
    L, q0, _ = system_and_start(L, q0, np.zeros(np.shape(q0)), None, coordinates, parameters, more)
    check_used(L, parameters, tables, given, ())
    if np.ndim(t) > 1 or np.size(t) != 2 and np.ndim(t) == 1:
        raise ValueError(f"`t` is {t!r}; it must be the final time, or (t0, t1)")
    t0, t1 = (0.0, t) if np.ndim(t) == 0 else t
    record = _core.search_path(L, copied(q0), copied(q1), (t0, t1), steps, integrator, z0, guess)
    return Path(L, np.linspace(t0, t1, steps + 1), record)
