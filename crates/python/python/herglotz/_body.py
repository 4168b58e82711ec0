"""Rigid bodies about a fixed point."""

import numpy as np

from . import _core
from ._events import Event
from ._rows import Rows, times_after
from ._solution import Interrupted, Plan
from ._system import Composed, copied, is_absent, warn_of_positive
from ._watch import NOTHING, Watch

# The columns of a row of the core, in their order, and the arrays that they are parts of.
_COLUMNS = "t q_w q_x q_y q_z Pi1 Pi2 Pi3 omega1 omega2 omega3 M1 M2 M3 tip_x tip_y tip_z energy z".split()
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


class RigidBodyStates(Rows):
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
        self._rows = rows

    def _columns(self):
        return {name: column for name, column in zip(_COLUMNS, self._rows.T) if name != "t"}

    def _arrays(self):
        data = {"attitude": (("t", "quaternion"), self.attitude), "tip": (("t", "axis_in_space"), self.tip)}
        data |= {name: (("t", "axis_in_body"), getattr(self, name)) for name in ("Pi", "omega")}
        data |= {"M": (("t", "axis_in_space"), self.M), "energy": ("t", self.energy), "z": ("t", self.z)}
        axes = {"quaternion": list("wxyz"), "axis_in_body": [1, 2, 3], "axis_in_space": list("xyz")}
        return data, axes, {}

    def _plotted(self):
        return "omega1", "omega2", "omega3"

    def __repr__(self):
        return f"<{type(self).__name__}: {len(self.t)} states>"


class RigidBodyDerivatives:
    """The derivatives of the end of a motion, those of the discrete motion to round-off.

    The end has seven coordinates: three of the turn R exp(turn) of the attitude in the body, in radians, three of the
    momentum Pi in the body, and the action z.

    Attributes
    ----------
    in_attitude : array of shape (7, 3)
        With respect to a turn of the initial attitude in the body.
    in_omega : array of shape (7, 3)
        With respect to the initial angular velocity.
    in_z : array of shape (7,)
        With respect to the initial action.
    in_parameters : dict of arrays of shape (7,)
        With respect to "inertia11", "inertia12", ..., "mass", "centre1", ..., "gravity1", ... and "gamma", for a fixed
        attitude and angular velocity at the start.
    log_factor : float
        The logarithm of the conformal factor.
    contact_defect : float
        The largest component of Phi* eta - sigma eta, relative to that of Phi* eta, for the contact form
        eta = dz - Pi.(R^-1 dR): round-off unless there is a torque.
    """

    def __init__(self, in_start, in_parameters, log_factor, contact_defect):
        self.in_attitude, self.in_omega, self.in_z = in_start[:, :3], in_start[:, 3:6], in_start[:, 6]
        self.in_parameters = dict(zip(_core.rigid_body_parameters(), in_parameters.T))
        self.log_factor, self.contact_defect = log_factor, contact_defect


class RigidBody(Composed):
    """A rigid body about a fixed point, for `solve`, `check` and `ensemble`; made by `body`.

    Attributes
    ----------
    parameters : dict
        The arguments of `body`, by name.

    Notes
    -----
    In the arguments of these functions `q0` is the attitude, a unit quaternion (w, x, y, z) that takes the body to space; by
    default it is the identity. `v0` is the angular velocity in the body, and `p0` the momentum in the body. `solve` and `path`
    return a `RigidBodySolution`, `ensemble` a list of them, and `check` a `Check`.
    """

    def __init__(self, given):
        self.parameters = given

    @property
    def system(self):
        """There is none: its configurations are rotations, and not the coordinates of a formula."""
        raise ValueError(
            "a rigid body is not a formula, since its configurations are rotations: it has motions by `solve`, `check` and "
            "`ensemble`, and derivatives by `Solution.sensitivity`, `Solution.pullback` and `value_and_grad`"
        )

    def with_parameters(self, parameters):
        """The body with other values of arguments of `body`."""
        unknown = [name for name in parameters if name not in self.parameters]
        if unknown:
            raise ValueError(f"the parameter {unknown[0]!r} is not one of a rigid body: it has {', '.join(self.parameters)}")
        return RigidBody(self.parameters | dict(parameters))

    def _solve(self, arguments):
        """The motion for the arguments of `solve`."""
        return rigid_body(**self._of(arguments, {"accuracy", "integrator", "step", "steps", "every", "events", *_WATCHED}))

    def _check(self, arguments):
        """The check for the arguments of `check`."""
        places, given = arguments.pop("places"), self._of(arguments, {"accuracy", "integrator", "step", "steps"})
        way = tuple(given.pop(name, None) for name in ("accuracy", "integrator", "step", "steps"))
        t = given.pop("t")
        return _core.check_rigid_body(*_request(**given), copied(t), way, places)

    def _value_and_grad(self, loss, arguments):
        """The value and the gradient for the arguments of `value_and_grad`."""
        from ._body_derivatives import value_and_gradient

        if not isinstance(loss, str):
            raise ValueError("the loss of a rigid body is a text over the columns of its rows, such as \"tip_z\"")
        sol = self._solve(arguments)
        if not sol.success:
            raise ValueError(f"the motion is not completed: {sol.status}")
        return value_and_gradient(sol, loss)

    def _ensemble(self, arguments):
        """The motions for the arguments of `ensemble`."""
        return rigid_bodies(**self._of(arguments, {"accuracy", "integrator", "step", "steps", "threads"}))

    def _path(self, arguments):
        """The motion between two attitudes for the arguments of `path`."""
        start, to = (_array(name, arguments.pop(name)) for name in ("q0", "q1"))
        t, guess = np.atleast_1d(np.asarray(arguments["t"], dtype=float)), arguments.pop("guess")
        given = self._of(arguments | {"v0": (0.0, 0.0, 0.0) if guess is None else guess}, {"steps", "integrator"})
        if guess is None and start.shape == to.shape == (4,):
            given["omega"] = _turn(start, to) / (t[-1] - (t[0] if len(t) > 1 else 0.0))
        return rigid_body_between(**given | {"attitude": start, "to": to})

    def _of(self, arguments, known):
        """The arguments of `rigid_body` and its like."""
        arguments = {name: x for name, x in arguments.items() if name == "t" or name != "L" and not is_absent(x)}
        given = dict(self.with_parameters(arguments.pop("parameters", {})).parameters)
        for name in arguments:
            if name not in known and name not in ("q0", "v0", "p0", "z0", "t"):
                raise ValueError(f"`{name}` is not there for rigid bodies: remove it")
        attitude, omega, momentum = (arguments.pop(name, None) for name in ("q0", "v0", "p0"))
        if (omega is None) == (momentum is None):
            raise ValueError("give either `v0`, the angular velocity in the body, or `p0`, the momentum")
        if arguments["t"] is None:
            raise ValueError("`t` is not given: give the final time, or the times of the rows")
        given["omega"] = omega if momentum is None else _velocity(given, momentum)
        return given | arguments | {"attitude": (1.0, 0.0, 0.0, 0.0) if attitude is None else attitude}

    def __repr__(self):
        return f"<RigidBody: inertia {np.asarray(self.parameters['inertia']).tolist()}>"


def _velocity(given, momentum):
    """The angular velocity of a momentum, by the inertia about the fixed point."""
    inertia, centre = _array("inertia", given["inertia"]), _array("centre", given["centre"])
    inertia = np.diag(inertia) if inertia.ndim == 1 else inertia
    inertia = inertia + given["mass"] * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return np.linalg.solve(inertia, _array("p0", momentum).T).T


def _turn(start, to):
    """The shortest turn from one attitude to another, in the body, as a vector."""
    w, u = start[0], start[1:]
    real, imaginary = w * to[0] + u @ to[1:], w * to[1:] - to[0] * u - np.cross(u, to[1:])
    size = np.linalg.norm(imaginary)
    angle = 2.0 * np.arctan2(size, abs(real))
    return imaginary * (np.copysign(angle, real) / size if size > 0.0 else 2.0)


_WATCHED = "progress", "callback", "callback_interval"


def body(inertia, *, mass=0.0, centre=(0.0, 0.0, 0.0), gravity=(0.0, 0.0, 0.0), gamma=0.0, torque=None):
    """A rigid body about a fixed point, for `solve`, `check` and `ensemble`; the arguments are those of `rigid_body`.

    Returns
    -------
    RigidBody

    Examples
    --------
    >>> import herglotz as hz
    >>> sol = hz.solve(hz.body((1, 2, 3), gamma=-0.1), v0=(1, 1/2, 1/3), t=10.0)
    >>> sol.status
    'completed'
    """
    return RigidBody(dict(inertia=inertia, mass=mass, centre=centre, gravity=gravity, gamma=gamma, torque=torque))


class RigidBodySolution(RigidBodyStates):
    """A motion of a rigid body with k rows; made by `rigid_body` and by `solve`.

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
    derivatives : RigidBodyDerivatives or None
        The derivatives of the end, where they were requested and the run was completed.
    """

    def __init__(self, record, events=0, request=None):
        super().__init__(record.rows)
        self._request, self._plan = request, None
        self.end = RigidBodyStates(record.end[np.newaxis])
        of = [[row for event, row in record.crossings if event == k] for k in range(events)]
        self.events = [RigidBodyStates(np.array(rows, dtype=float).reshape(-1, 19)) for rows in of]
        self.status, self.success, self.integrator = record.status, record.success, record.integrator
        self.step_size, self.steps, self.error_estimate = record.step_size, record.steps, record.error_estimate
        self.derivatives = None if record.derivatives is None else RigidBodyDerivatives(*record.derivatives)

    @property
    def t_end(self):
        """The time that was reached."""
        return float(self.end.t[0])

    @property
    def plan(self):
        """The plan: what was computed and what was skipped; ``print(sol.plan)``."""
        if self._plan is None:
            self._plan = Plan(*_core.plan_rigid_body(*self._request[:-1]))
        return self._plan

    def _way(self):
        """The steps that were taken."""
        way = self._request[4]
        return way if way[0] is None and way[1] is not None else (None, self.integrator, abs(self.step_size), None)

    def __call__(self, t):
        """The states at other times of the motion, each by a shorter step of the integrator; the motion is run again.

        Parameters
        ----------
        t : float or array of shape (k,)

        Returns
        -------
        RigidBodyStates
        """
        body, start, asked, _, _, events, _ = self._request
        times = np.array(t, dtype=float, ndmin=1)
        asked = np.atleast_1d(np.asarray(asked, dtype=float))
        first, last = asked[0] if len(asked) > 1 else 0.0, self.t_end
        outside = [x for x in times.ravel() if not min(first, last) <= x <= max(first, last)]
        if outside:
            raise ValueError(f"t = {outside[0]} is not in the motion, which is from {first} to {last}")
        # The steps are those of the whole span: a run that a terminal event has ended meets it again.
        end = asked[-1] if self.success else last
        order = np.unique(np.concatenate([times.ravel(), [first, end]]))
        order = order if end >= first else order[::-1]
        found = _core.run_rigid_body(body, start, order, None, self._way(), events, False, None)
        at = {row[0]: row for row in found.rows} | {last: found.end}
        return RigidBodyStates(np.array([at[x] for x in times.ravel()]))

    def resume(self, t=None, *, progress=False, callback=None, callback_interval=1.0):
        """Continues from the end of the motion, with the same integrator and steps of the same length.

        Parameters
        ----------
        t : float or array, optional
            The new final time; or the times of the rows, beyond the end of this motion, the first of which may be that end. By
            default the requested times that were not reached.
        progress, callback, callback_interval
            As in `solve`.

        Returns
        -------
        RigidBodySolution
            The motion from the end of this one.
        """
        watch = Watch(progress, callback, callback_interval)
        body, _, asked, every, _, events, _ = self._request
        times = times_after(asked, self.t_end, t)
        end = self.end
        start = end.attitude[0], end.omega[0], float(end.z[0])
        way = None, self.integrator, abs(self.step_size), None
        return _solution((body, start, times, every, way, events, False), watch)

    def sensitivity(self, variables):
        """The derivatives of the rows, of the end and of the times of events with respect to variables.

        They are those of the discrete motion, to round-off; those of a row between two steps are those after a shorter step. The
        motion is run once more, by a Gauss method, whose steps were given or chosen.

        Parameters
        ----------
        variables : str or list of str
            The names of m variables: of the start ``"turn1"`` to ``"turn3"``, a turn of the attitude in the body, ``"omega1"`` to
            ``"omega3"`` and ``"z"``; and the parameters ``"inertia11"``, ``"inertia12"``, ..., ``"mass"``, ``"centre1"``, ...,
            ``"gravity1"``, ... and ``"gamma"``, for a fixed attitude and angular velocity at the start.

        Returns
        -------
        RigidBodySensitivity

        Examples
        --------
        >>> import herglotz as hz
        >>> top = hz.body((1, 1, 0.5), mass=1.0, centre=(0, 0, 1), gravity=(0, 0, -9.81), gamma=-0.05)
        >>> sol = hz.solve(top, v0=(0.1, 0, 20), t=[0, 1], integrator="gauss_4", step=0.01)
        >>> sol.sensitivity("mass").tip.shape
        (2, 3)
        """
        from ._body_derivatives import sensitivity

        return sensitivity(self, variables, _PARTS)

    def pullback(self, q=None, v=None, p=None, z=None):
        """The gradient of a number with these partial derivatives in the rows.

        Parameters
        ----------
        q, v, p : arrays of shape (k, 3), or (3,) for the last row only
            The partial derivatives in turns of the attitude in the body, in the angular velocity and in the momentum Pi; those in v
            and p are added.
        z : array of shape (k,), or a number for the last row only

        Returns
        -------
        Gradient
            ``q0`` is the derivative in a turn of the initial attitude in the body, ``v0`` that in the initial angular velocity,
            ``parameters`` has those of `sensitivity`. ``t0`` is None where it is not known: with a torque, or several rows.
        """
        from ._body_derivatives import pullback

        return pullback(self, q, v, p, z)

    def __repr__(self):
        return f"<RigidBodySolution: {len(self.t)} rows, t = {self.t_end}, {self.steps} steps, {self.status}>"


def rigid_body(
    inertia,
    *,
    mass=0.0,
    centre=(0.0, 0.0, 0.0),
    gravity=(0.0, 0.0, 0.0),
    gamma=0.0,
    torque=None,
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
    sensitivity=False,
    progress=False,
    callback=None,
    callback_interval=1.0,
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
    torque : sequence of three str, optional
        A torque that has no potential: its components along the axes of the body, such as ``("-0.1*omega1", "0", "0")``,
        in the names t, q_w, q_x, q_y, q_z, omega1 to omega3, z. It takes a Gauss method. Steps end at kinks and jumps at
        times that the texts name, as at those of ``"if(t > 2, if(t < 2.1, 50, 0), 0)"``.
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
        are given. The number of steps is doubled until two runs differ by at most this; a motion that takes too many is
        refused.
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
    sensitivity : bool
        Also compute the derivatives of the end in the start and in the parameters, `RigidBodySolution.derivatives`. It
        takes a Gauss method, which is "gauss_4" where only an accuracy is given.
    progress, callback, callback_interval
        As in `solve`.

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
    watch = Watch(progress, callback, callback_interval)
    body, start = _request(inertia, mass, centre, gravity, gamma, torque, attitude, omega, z0)
    if t is None:
        raise ValueError("`t` is not given: give the final time, or the times of the rows")
    events = [_event(event) for event in ([events] if isinstance(events, (str, Event)) else events)]
    if sensitivity and integrator is None and step is None and steps is None:
        integrator = "gauss_4"
    way = accuracy, integrator, step, steps
    return _solution((body, start, copied(t), every, way, events, bool(sensitivity)), watch)


def _solution(request, watch=NOTHING):
    """The solution of a request, unless a signal ended the run."""

    def solution(record):
        return RigidBodySolution(record, len(request[5]), request)

    record = watch.run(lambda watched: _core.run_rigid_body(*request, watched), solution)
    sol = solution(record)
    if record.interrupted is not None:
        if isinstance(record.interrupted, KeyboardInterrupt):
            raise Interrupted(sol)
        raise record.interrupted
    return sol


def rigid_body_between(
    inertia,
    *,
    mass=0.0,
    centre=(0.0, 0.0, 0.0),
    gravity=(0.0, 0.0, 0.0),
    gamma=0.0,
    torque=None,
    attitude=(1.0, 0.0, 0.0, 0.0),
    to=None,
    omega=None,
    z0=0.0,
    t=None,
    integrator="gauss_4",
    step=None,
    steps=None,
):
    """A motion of a rigid body between two attitudes, such as a reorientation in a given time.

    The angular velocity at the start is found by Newton's method with the derivatives of the discrete motion. There may
    be other motions, with more turns.

    Parameters
    ----------
    inertia, mass, centre, gravity, gamma, torque, attitude, z0, t, integrator, step, steps
        Those of `rigid_body`; by default there are 200 steps.
    to : array of shape (4,)
        The attitude at the end, a unit quaternion (w, x, y, z).
    omega : array of shape (3,)
        A guess of the angular velocity at the start.

    Returns
    -------
    RigidBodySolution
        The motion from the angular velocity that was found, ``sol.omega[0]``.

    Raises
    ------
    ValueError
        For an invalid argument, and where no motion is found.

    Examples
    --------
    A turn by half a right angle about the second axis in two time units:

    >>> import numpy as np, herglotz as hz
    >>> to = np.cos(np.pi / 8), 0, np.sin(np.pi / 8), 0
    >>> sol = hz.rigid_body_between((1, 2, 3), gamma=-0.1, to=to, omega=(0, 0.3, 0), t=[0, 2])
    >>> bool(abs(sol.attitude[-1] - to).max() < 1e-12)
    True
    """
    if to is None:
        raise ValueError("`to` is not given: give the attitude at the end")
    if t is None:
        raise ValueError("`t` is not given: give the final time, or the times of the rows")
    body, start = _request(inertia, mass, centre, gravity, gamma, torque, attitude, omega, z0)
    if step is None and steps is None:
        steps = 200
    way = None, integrator, step, steps
    found = _core.rigid_body_between(body, start, copied(t), way, copied(to))
    start = start[0], np.array(found), start[2]
    return _solution((body, start, copied(t), None, way, [], False))


def rigid_bodies(
    inertia,
    *,
    mass=0.0,
    centre=(0.0, 0.0, 0.0),
    gravity=(0.0, 0.0, 0.0),
    gamma=0.0,
    torque=None,
    attitude=(1.0, 0.0, 0.0, 0.0),
    omega=None,
    z0=0.0,
    t=None,
    accuracy=None,
    integrator=None,
    step=None,
    steps=None,
    threads=None,
):
    """Motions of many rigid bodies, on several threads; the results do not depend on the number of threads.

    Parameters
    ----------
    inertia, mass, centre, gravity, gamma, attitude, omega, z0
        Those of `rigid_body`, or with one more axis in front, of m entries: one for each body. A matrix of shape (3, 3)
        is one inertia tensor.
    torque, t, accuracy, integrator, step, steps
        Those of `rigid_body`, the same for all bodies.
    threads : int, optional
        The number of threads; by default that of the processors.

    Returns
    -------
    list of RigidBodySolution

    Raises
    ------
    ValueError
        For an invalid argument, with the number of the body.

    Examples
    --------
    >>> import herglotz as hz
    >>> found = hz.rigid_bodies((1, 2, 3), gamma=[0, -0.1, -0.2], omega=(1, 0.5, 0.25), t=5.0)
    >>> [sol.success for sol in found]
    [True, True, True]
    """
    if omega is None:
        raise ValueError("`omega` is not given: give the initial angular velocities in the bodies")
    if t is None:
        raise ValueError("`t` is not given: give the final time, or the times of the rows")
    inertia = _array("inertia", inertia)
    given = {
        "inertia": (inertia, 2 if inertia.shape[-2:] == (3, 3) else 1),
        "mass": (mass, 0),
        "centre": (centre, 1),
        "gravity": (gravity, 1),
        "gamma": (gamma, 0),
        "attitude": (attitude, 1),
        "omega": (omega, 1),
        "z0": (z0, 0),
    }
    counts, arrays = {}, {}
    for name, (x, axes) in given.items():
        arrays[name] = np.asarray(_array(name, x)) if axes else np.array(x, dtype=float)
        if arrays[name].ndim == axes + 1:
            counts[name] = len(arrays[name])
        elif arrays[name].ndim != axes:
            raise ValueError(f"`{name}` has the shape {arrays[name].shape}; it must have {axes} or {axes + 1} axes")
    if len(set(counts.values())) > 1:
        all_counts = ", ".join(f"`{name}` {count}" for name, count in counts.items())
        raise ValueError(f"the numbers of bodies differ: {all_counts}")
    count = next(iter(counts.values()), 1)
    members = []
    for k in range(count):
        of = {name: x[k] if name in counts else x for name, x in arrays.items()}
        members.append(_request(torque=torque, **of))
    t, way = copied(t), (accuracy, integrator, step, steps)
    records = _core.run_rigid_bodies(members, t, way, threads)
    return [
        RigidBodySolution(record, request=(*member, t, None, way, [], False)) for member, record in zip(members, records)
    ]


def _request(inertia, mass, centre, gravity, gamma, torque, attitude, omega, z0):
    """A body and its start as they are passed to the core."""
    if omega is None:
        raise ValueError("`omega` is not given: give the initial angular velocity in the body")
    warn_of_positive(gamma)
    inertia = _array("inertia", inertia)
    if inertia.shape not in ((3,), (3, 3)):
        raise ValueError(f"`inertia` has the shape {inertia.shape}; it must be (3,) or (3, 3)")
    for name, x, shape in (("centre", centre, 3), ("gravity", gravity, 3), ("attitude", attitude, 4), ("omega", omega, 3)):
        if _array(name, x).shape != (shape,):
            raise ValueError(f"`{name}` has the shape {_array(name, x).shape}; it must be ({shape},)")
    if torque is not None:
        torque = [torque] if isinstance(torque, str) else list(torque)
        if len(torque) != 3 or not all(isinstance(component, (str, int, float)) for component in torque):
            raise ValueError(f"`torque` is {torque!r}; it must be three texts, the components along the axes of the body")
        torque = [str(component) for component in torque]
    return (inertia.ravel(), mass, centre, gravity, gamma, torque), (attitude, omega, z0)


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
