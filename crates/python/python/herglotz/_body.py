"""Rigid bodies about a fixed point."""

import numpy as np

from . import _core
from ._events import Event
from ._solution import Interrupted
from ._system import copied

# The columns of a row of the core, in their order.
_PARTS = {
    "t": 0,
    "attitude": slice(1, 5),
    "Pi": slice(5, 8),
    "omega": slice(8, 11),
    "M": slice(11, 14),
    "tip": slice(14, 17),
    "energy": 17,
    "z": 18,
}


class RigidBodyStates:
    """States of a rigid body, one for each entry of `t`.

    Attributes
    ----------
    t : array of shape (k,)
        The times.
    attitude : array of shape (k, 4)
        Unit quaternions (w, x, y, z), which take the body to space.
    Pi, omega : arrays of shape (k, 3)
        Momentum and angular velocity in the body.
    M : array of shape (k, 3)
        Momentum in space.
    tip : array of shape (k, 3)
        The centre of mass in space; the end of the third axis of the body where the centre of mass is fixed.
    energy, z : arrays of shape (k,)
        The energy Pi.omega/2 - m g.(R X) - gamma z, and the action.
    """

    def __init__(self, rows):
        for name, part in _PARTS.items():
            setattr(self, name, rows[:, part])

    def __repr__(self):
        return f"<{type(self).__name__}: {len(self.t)} states>"


class RigidBodySolution(RigidBodyStates):
    """A motion of a rigid body with k rows; made by `rigid_body`.

    It has the arrays of `RigidBodyStates`.

    Attributes
    ----------
    end : RigidBodyStates
        The state that was reached, as arrays of length 1.
    events : list of RigidBodyStates
        The states at the sign changes of each event.
    status : str
        How the run ended; ``success`` is whether it ended as requested.
    integrator : str
        The integrator.
    step_size, steps : float, int
        The length of a step, and the number of steps taken.
    error_estimate : float or None
        A bound of the error of the attitude (in radians) and of the momentum (relative), where an accuracy was
        requested.
    """

    def __init__(self, record, events):
        super().__init__(record.rows)
        self.end = RigidBodyStates(record.end[np.newaxis])
        of = [[row for event, row in record.crossings if event == k] for k in range(events)]
        self.events = [RigidBodyStates(np.array(rows, dtype=float).reshape(-1, 19)) for rows in of]
        self.status, self.success, self.integrator = record.status, record.success, record.integrator
        self.step_size, self.steps, self.error_estimate = record.step_size, record.steps, record.error_estimate

    @property
    def t_end(self):
        """The time that was reached."""
        return float(self.end.t[0])

    def __repr__(self):
        return f"<RigidBodySolution: {len(self.t)} rows, t = {self.t_end}, {self.steps} steps, {self.status}>"


def rigid_body(
    inertia,
    *,
    mass=0.0,
    centre=(0.0, 0.0, 0.0),
    gravity=(0.0, 0.0, 0.0),
    gamma=0.0,
    attitude=(1.0, 0.0, 0.0, 0.0),
    omega=None,
    z0=0.0,
    t=None,
    accuracy=None,
    integrator=None,
    step=None,
    steps=None,
    every=None,
    events=(),
):
    """The motion of a rigid body about a fixed point, with gravity and linear drag, on the rotation group.

    Its Lagrangian is omega.J omega/2 + m g.(R X) + gamma z, with the inertia J = I + m (|X|^2 1 - X X^T) about the fixed
    point. No attitude is singular, and momenta that are conserved without drag scale by e^(gamma t) to round-off.

    Parameters
    ----------
    inertia : array of shape (3,) or (3, 3)
        The inertia tensor I about the centre of mass in the body: principal moments, or a symmetric matrix.
    mass : float
        The mass m.
    centre : array of shape (3,)
        The centre of mass X in the body, from the fixed point.
    gravity : array of shape (3,)
        The acceleration of gravity g in space, such as (0, 0, -9.81).
    gamma : float
        The rate of the drag, negative for dissipation.
    attitude : array of shape (4,)
        The initial attitude, a unit quaternion (w, x, y, z) that takes the body to space.
    omega : array of shape (3,)
        The initial angular velocity in the body.
    z0 : float
        The initial action.
    t : float or array of shape (k,)
        The times of the rows: the first is the initial time, the last the final time, in either direction. A single
        number is the final time of a motion from 0.
    accuracy : float, optional
        The error of the attitude (in radians) and of the momentum (relative) at the end; 1e-9 by default, where no steps
        are given. The number of steps is doubled until two runs differ by at most this.
    integrator : str, optional
        A splitting such as "sofroniou_spaletta_10" (the default), for which fast rotation costs no steps, or a Gauss
        method such as "gauss_4", whose steps turn the body by less than pi.
    step, steps : float, int, optional
        The length or the number of the steps, in place of an accuracy.
    every : int, optional
        Record a row every `every` steps, in place of the rows at `t`.
    events : sequence, optional
        Functions whose sign changes are located: texts such as ``"tip_z - 0.5"``, or `Event` objects of a text, in
        the names t, q_w, q_x, q_y, q_z, Pi1 to Pi3, omega1 to omega3, M1 to M3, tip_x, tip_y, tip_z, z.

    Returns
    -------
    RigidBodySolution

    Raises
    ------
    ValueError
        For an invalid argument, such as a quaternion that is not a unit quaternion, an inertia that violates the
        triangle inequality, or a step that turns the body too far.
    Interrupted
        A `KeyboardInterrupt` with the solution up to the interruption.

    Examples
    --------
    A body that tumbles under drag:

    >>> import numpy as np, herglotz as hz
    >>> sol = hz.rigid_body((1, 2, 3), gamma=-0.1, omega=(1, 1/2, 1/3), t=np.linspace(0, 10, 101))
    >>> sol.attitude.shape
    (101, 4)
    """
    if omega is None:
        raise ValueError("`omega` is not given: give the initial angular velocity in the body")
    if t is None:
        raise ValueError("`t` is not given: give the final time, or the times of the rows")
    inertia = _array("inertia", inertia)
    if inertia.shape not in ((3,), (3, 3)):
        raise ValueError(f"`inertia` has the shape {inertia.shape}; it must be (3,) or (3, 3)")
    for name, x, shape in (("centre", centre, 3), ("gravity", gravity, 3), ("attitude", attitude, 4), ("omega", omega, 3)):
        if _array(name, x).shape != (shape,):
            raise ValueError(f"`{name}` has the shape {_array(name, x).shape}; it must be ({shape},)")
    body = inertia.ravel(), mass, centre, gravity, gamma
    events = [_event(event) for event in ([events] if isinstance(events, (str, Event)) else events)]
    way = accuracy, integrator, step, steps
    record = _core.run_rigid_body(body, (attitude, omega, z0), copied(t), every, way, events)
    sol = RigidBodySolution(record, len(events))
    if record.interrupted is not None:
        if isinstance(record.interrupted, KeyboardInterrupt):
            raise Interrupted(sol)
        raise record.interrupted
    return sol


def _array(name, x):
    """The numbers of an argument, copied."""
    try:
        return np.array(x, dtype=float, ndmin=1)
    except (TypeError, ValueError) as error:
        raise ValueError(f"`{name}` must be an array of real numbers: {error}") from None


def _event(event):
    """The text, the direction and the end of an event."""
    if isinstance(event, str):
        return event, "both", False
    plain = isinstance(event, Event) and isinstance(event.when, str)
    if not plain or (event.reset, event.impact, event.rest) != (None, None, None):
        raise ValueError(f"the event {event!r} of a rigid body must be a text, or an `Event` of a text without a reset")
    if event.direction not in ("both", "rising", "falling"):
        raise ValueError(f'`direction` is {event.direction!r}; it must be "both", "rising" or "falling"')
    return event.when, event.direction, bool(event.terminal)
