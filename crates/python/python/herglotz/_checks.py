"""Checks: geometry at a point, contact maps, contact steps, and comparisons of integrators."""

from typing import NamedTuple

import numpy as np

from . import _core, _trace
from ._additions import breaks_of
from ._events import events_of, texts_of_events
from ._method import integrator_of
from ._solve import functions_of, system_and_start
from ._system import Composed, check_used, system_of, with_tables


class Geometry(NamedTuple):
    """The contact geometry of L at a time and a point of TQ x R, in n coordinates; vectors have the order q, v, z."""

    lagrangian: float
    momentum: np.ndarray  # (n,)
    energy: float
    rate: float
    mass: np.ndarray  # (n, n)
    condition: float
    eta: np.ndarray  # (2n + 1,)
    reeb: np.ndarray  # (2n + 1,)
    volume: float
    herglotz_field: np.ndarray  # (2n + 1,)


class HamiltonianGeometry(NamedTuple):
    """The contact geometry of H at a time and a point of T*Q x R, in n coordinates; vectors have the order q, p, z."""

    hamiltonian: float
    velocity: np.ndarray  # (n,)
    rate: float
    hessian: np.ndarray  # (n, n)
    condition: float
    eta: np.ndarray  # (2n + 1,)
    reeb: np.ndarray  # (2n + 1,)
    field: np.ndarray  # (2n + 1,)
    lie_derivative: np.ndarray  # (2n + 1,)
    brackets: np.ndarray  # (2n + 1,)


def geometry(
    L=None,
    t=0.0,
    q=None,
    v=None,
    z=0.0,
    *,
    H=None,
    p=None,
    coordinates=None,
    parameters=None,
    momenta=None,
    action=None,
):
    """The contact geometry of a Lagrangian, or of a contact Hamiltonian, at a point.

    Parameters
    ----------
    L, H, coordinates, parameters, momenta, action
        As in `solve`.
    t, z : float
    q, v : arrays of shape (n,)
    p : array of shape (n,)
        For a Hamiltonian, the momentum in place of v.

    Returns
    -------
    Geometry or HamiltonianGeometry
        For a Hamiltonian: H, the velocity H_p, the rate -H_z, H_pp and its condition, eta = dz - p dq and its Reeb field,
        the field X_H = (H_p, -H_q - p H_z, p.H_p - H), L_X eta = -H_z eta, and the Jacobi brackets of H with q, p and z.
        For a Lagrangian:
        L, the momentum L_v (the Legendre transformation is (q, v, z) -> (q, p, z)), the energy v.p - L, the rate L_z,
        the mass matrix W = L_vv and its condition, the contact form eta = dz - L_v dq, its Reeb field, the volume
        eta ^ (d eta)^n, and the Herglotz field (v, a, L).
    """
    if q is None:
        raise ValueError("`q` is not given: give the position")
    names = dict(H=H, momenta=momenta, action=action)
    of = system_of(L, coordinates, parameters, n=np.size(q), **names)
    check_used(of, parameters, None, (L if H is None else H,), ())
    if of.kind[0]:
        if p is None or v is not None:
            raise ValueError("give `p` for a Hamiltonian, and not `v`")
        found = _core.hamiltonian_geometry(of, (t, q, p, z))
        return HamiltonianGeometry(**{name: np.array(x) if isinstance(x, list) else x for name, x in found.items()})
    if v is None or p is not None:
        raise ValueError("give `v` for a Lagrangian, and not `p`")
    found = _core.geometry(of, (t, q, v, z))
    return Geometry(**{name: np.array(x) if isinstance(x, list) else x for name, x in found.items()})


class Contact(NamedTuple):
    """The pullback of dz - p dq by a map (q, p, z) -> (q, p, z)."""

    is_contact: bool
    sigma: float
    defect: float
    image: np.ndarray  # (2n + 1,)
    jacobian: np.ndarray  # (2n + 1, 2n + 1)

    def __bool__(self):
        return self.is_contact

    def __str__(self):
        if self.is_contact:
            return f"contact: F*(dz - p dq) = sigma (dz - p dq), sigma = {self.sigma!r}, to {self.defect:.1e}"
        if self.sigma == 0.0:
            return "not contact: sigma is 0, so that F*(dz - p dq) is not a contact form"
        return f"not contact: F*(dz - p dq) differs from {self.sigma!r} (dz - p dq) by {self.defect:.1e} of its size"


def is_contact(map, at, *, tolerance=1e-9):
    """Whether a map (q, p, z) -> (q, p, z) is a contact transformation at a point.

    The map is called once with tracers, and its derivatives are exact: the defect of a contact map is round-off, that
    of a Runge-Kutta step is of the size of its error.

    Parameters
    ----------
    map : function (q, p, z) -> (q, p, z)
        q and p have the shape (n,).
    at : tuple (q, p, z)
        The point.
    tolerance : float
        The largest defect of a map that counts as contact.

    Returns
    -------
    Contact
        True or false, the conformal factor sigma, and the largest component of ``F*eta - sigma eta``, relative to ``F*eta``.
        A map with sigma = 0 is not contact.
    """
    try:
        q, p, z = at
    except (TypeError, ValueError):
        raise ValueError("`at` must be a point (q, p, z)") from None
    n = np.size(q)
    if n == 0:
        raise ValueError("`at` has an empty q: give at least one coordinate")
    tables = {}
    components = _trace.components_of(map, n, tables)
    sigma, defect, image, jacobian = _core.conformality(components, list(tables.items()), (q, p, z))
    # NaN does not count as contact, and neither does the factor 0, with which the pullback is not a contact form.
    is_so = defect <= tolerance and sigma != 0.0 and np.isfinite(sigma)
    return Contact(bool(is_so), sigma, defect, image, jacobian)


class Place(NamedTuple):
    """A step of a motion that was checked."""

    t: float
    sigma: float
    log_factor: float
    contact_defect: float
    herglotz_defect: float
    momenta: list  # (momentum, prediction of Noether's theorem) of each symmetry


class Check(NamedTuple):
    """Whether the steps of a motion are contact, and the residuals of the theorems of the discrete theory along it."""

    is_contact: bool
    integrator: str
    step: float
    places: list
    statements: list  # (statement, discrete Lagrangian, residual)
    losses: list  # what contact flows have and this motion does not, because of a force or a reset, with the reasons

    def __bool__(self):
        return self.is_contact

    def __str__(self):
        defect = max((place.contact_defect for place in self.places), default=0.0)
        is_so = "contact" if self.is_contact else "not contact"
        first = f"{is_so}: {len(self.places)} steps of {self.step!r} by {self.integrator}, largest defect {defect:.1e}"
        return "\n".join([first, *(f"  {loss}" for loss in self.losses)])


def _motion(L, q0, v0, t, p0, z0, way, coordinates, parameters, more, kind, events=()):
    force, rayleigh, tables, breaks, *_ = more
    given = L if kind[0] is None else kind[0], *functions_of(force, rayleigh)
    L, q0, v0 = system_and_start(L, q0, v0, p0, coordinates, parameters, more, kind)
    if (v0 is None) == (p0 is None):
        raise ValueError("give either `v0` or `p0`")
    start = (q0, v0, False, z0, None) if p0 is None else (q0, p0, True, z0, None)
    if t is None:
        raise ValueError("`t` is not given: give the final time")
    if breaks is not None:
        breaks_of(breaks, t)
    found = {}
    events = events_of(events, L, found) if events else []
    L = with_tables(L, found)
    check_used(L, parameters, tables, given, list(texts_of_events(events)))
    accuracy, integrator, *steps = way
    way = (accuracy, integrator_of(integrator, L), *steps)
    return L, _core.Motion(L, start, t, None, way, events, [], False, False, None)


def check(
    L=None,
    q0=None,
    v0=None,
    t=None,
    *,
    H=None,
    p0=None,
    z0=0.0,
    places=10,
    accuracy=None,
    integrator=None,
    step=None,
    steps=None,
    events=(),
    coordinates=None,
    parameters=None,
    force=None,
    rayleigh=None,
    tables=None,
    breaks=None,
    momenta=None,
    action=None,
    constraints=None,
):
    """Whether the steps of a motion are contact: sigma, defects and momenta at some places, and the discrete theorems.

    The arguments are those of `solve`; `places` is the number of steps that are checked. A motion with a force is not
    contact: ``losses`` says what is lost, and in place of the theorems ``statements`` compares the contact defect of a
    step with the virtual work of the force. A reset, or an impact with a restitution below 1, is not contact either.

    Returns
    -------
    Check
    """
    arguments = locals()
    if isinstance(L, Composed) and hasattr(L, "_check"):
        return _check(L._check(arguments), [])
    way = accuracy, integrator, step, steps
    more, kind = (force, rayleigh, tables, breaks, constraints, None), (H, momenta, action)
    of, motion = _motion(L, q0, v0, t, p0, z0, way, coordinates, parameters, more, kind, events)
    return _check(_core.check(motion, places), of.losses)


def _check(found, losses):
    integrator, step, places, statements, contact, reason = found
    losses = losses or ([reason] if reason else [])
    return Check(contact, integrator, step, [Place(*place) for place in places], statements, losses)


class Work(NamedTuple):
    """A run of a comparison."""

    integrator: str
    order: int
    step: float
    steps: int
    evaluations: int
    error: float
    seconds: float


class Comparison:
    """Run time against error; made by `compare`."""

    def __init__(self, rows, reference, left_out, losses):
        self.rows = [Work(*row) for row in rows]
        self.reference, self.left_out, self.losses = reference, dict(left_out), losses

    def best(self, error):
        """The fastest run with at most this error; None where there is none."""
        return min((row for row in self.rows if row.error <= error), key=lambda row: row.seconds, default=None)

    def to_pandas(self):
        """The runs as a `pandas.DataFrame`."""
        import pandas

        return pandas.DataFrame(self.rows, columns=Work._fields)

    def plot(self, ax=None):
        """Plots run time in seconds against error with matplotlib."""
        import matplotlib.pyplot

        ax = matplotlib.pyplot.gca() if ax is None else ax
        for name in dict.fromkeys(row.integrator for row in self.rows):
            mine = [row for row in self.rows if row.integrator == name]
            ax.loglog([row.error for row in mine], [row.seconds for row in mine], ".-", label=name)
        ax.set_xlabel("error")
        ax.set_ylabel("seconds")
        ax.legend(fontsize="x-small")
        return ax


def compare(
    L=None,
    q0=None,
    v0=None,
    t=None,
    *,
    H=None,
    p0=None,
    z0=0.0,
    method=None,
    coordinates=None,
    parameters=None,
    force=None,
    rayleigh=None,
    tables=None,
    breaks=None,
    momenta=None,
    action=None,
    constraints=None,
    friction=None,
):
    """Run time against error for all integrators that apply to a motion; the arguments are those of `solve`.

    With `method`, a discrete Lagrangian of one's own is measured beside them. ``left_out`` has the reasons why others do not apply, and ``losses`` what a motion with a force loses.

    Returns
    -------
    Comparison
    """
    more, kind = (force, rayleigh, tables, breaks, constraints, friction), (H, momenta, action)
    way = (None, method, *((None, None) if method is None else (1.0, None)))
    of, motion = _motion(L, q0, v0, t, p0, z0, way, coordinates, parameters, more, kind)
    return Comparison(*_core.compare(motion), of.losses)
