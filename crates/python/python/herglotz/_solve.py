"""One motion: its request and its run."""

from . import _core
from ._solution import Interrupted, Solution
from ._system import check_parameters, copied, expression, system


def solve(
    L,
    q0=None,
    v0=None,
    t=None,
    *,
    p0=None,
    z0=0.0,
    accuracy=None,
    integrator=None,
    step=None,
    steps=None,
    every=None,
    events=(),
    observe=None,
    conformal_factor=False,
    estimate=False,
    scales=None,
    coordinates=None,
    parameters=None,
):
    """The motion of a Lagrangian system: Herglotz' equation, d/dt L_v = L_q + L_z L_v with dz/dt = L.

    Parameters
    ----------
    L : function, str, SymPy expression or System
        ``L(t, q, v, z)``, which is called once with tracers; a formula; the name of a system of the catalogue, with its
        default start; or the result of `system`.
    q0, v0 : array of shape (n,)
        Initial position and velocity.
    t : float or array of shape (k,)
        The times of the rows: the first is the initial time, the last the final time, in either direction. A single
        number is the final time of a motion from 0.
    p0 : array of shape (n,), optional
        The initial momentum, in place of `v0`.
    z0 : float
        The initial action.
    accuracy : float, optional
        The requested error, by default 1e-9: that of (q, p) relative to its size, and that of v relative to the largest
        speed. The step is chosen for it, and also the integrator where none is named.
    integrator : str, optional
        One of the names that `integrators` returns.
    step, steps : float, int, optional
        The length or the number of steps of `integrator`, in place of an accuracy.
    every : int, optional
        Record a row every `every` steps, in place of the rows at `t`.
    events : str, Event, or a list or dict of them
        Functions of time and state whose sign changes are located.
    observe : dict of str or functions, optional
        Expressions by name: additional columns, ``sol["name"]``.
    conformal_factor : bool
        Whether `Solution.log_factor` is computed.
    estimate : bool
        Whether `Solution.error_estimate` is computed. For given steps it takes a second run with steps of half the
        length, which costs twice as much as the first.
    scales : array of shape (n,), optional
        The size of each coordinate, where they differ much or have different units: `accuracy` and `estimate` then
        apply to each coordinate and its velocity in units of its size.
    coordinates, parameters
        As in `system`.

    Returns
    -------
    Solution

    Raises
    ------
    ValueError
        For an invalid argument.
    Interrupted
        A `KeyboardInterrupt` with the solution up to the interruption.
    """
    given = L
    if type(L) is not _core.System or parameters is not None or q0 is None:
        L, q0, v0 = system_and_start(L, q0, v0, p0, coordinates, parameters)
    if t is None:
        raise ValueError("`t` is not given: give the final time, or the times of the rows")
    if (v0 is None) == (p0 is None):
        raise ValueError("give either `v0` or `p0`")
    request = (
        (copied(q0), copied(v0), False, z0, None) if p0 is None else (copied(q0), copied(p0), True, z0, None),
        copied(t),
        every,
        (accuracy, integrator, step, steps),
        events_of(events, L) if events else [],
        columns_of(observe, L),
        conformal_factor,
        estimate,
        copied(scales),
    )
    if parameters:
        check_parameters(L, parameters, given, [*(event[0] for event in request[4]), *request[5]])
    event_names = tuple(events) if isinstance(events, dict) else len(request[4])
    return run(L, request, event_names, tuple(observe) if observe else ())


def run(L, request, event_names, observed, halted=None):
    """The solution of a request, or the remaining part of an interrupted one."""
    motion = _core.Motion(L, *request)
    record = _core.run(motion) if halted is None else _core.resume(motion, *halted)
    sol = Solution(L, request, record, event_names, observed)
    if record.interrupted is not None:
        if isinstance(record.interrupted, KeyboardInterrupt):
            raise Interrupted(sol)
        raise record.interrupted
    return sol


def system_and_start(L, q0, v0, p0, coordinates, parameters):
    """The system of an argument, and the start, which the catalogue may provide."""
    if isinstance(L, str) and L in CATALOGUE:
        entry = CATALOGUE[L]
        if q0 is None and v0 is None and p0 is None:
            q0, v0 = entry[5], entry[6]
    if q0 is None:
        raise ValueError("`q0` is not given: give the initial position")
    n = len(q0) if hasattr(q0, "__len__") else 1
    return system(L, coordinates, parameters, n=n), q0, v0


CATALOGUE = {entry[0]: entry for entry in _core.catalogue()}


class Event:
    """A function of time and state whose sign changes are located.

    Parameters
    ----------
    when : str or function
        An expression, in the syntax of formulas: ``"theta"``, ``"x'*y - 1"``; or a function of (t, q, v, z), which is
        traced.
    direction : {"both", "rising", "falling"}
        Which sign changes count, in the direction of the motion.
    terminal : bool
        Whether the first sign change ends the motion.
    """

    __slots__ = ("when", "direction", "terminal")

    def __init__(self, when, direction="both", terminal=False):
        self.when, self.direction, self.terminal = when, direction, terminal

    def __repr__(self):
        return f"Event({self.when!r}, {self.direction!r}, terminal={self.terminal})"


def columns_of(observe, L):
    """The texts of the observed expressions."""
    if not observe:
        return []
    if not hasattr(observe, "values"):
        raise ValueError(f'`observe` is {observe!r}; it must give expressions by name, as in observe={{"square": "x^2"}}')
    return [expression(column, L) for column in observe.values()]


def events_of(events, L):
    """The events in the form of the core."""
    if isinstance(events, (str, Event)) or callable(events):
        events = [events]
    elif isinstance(events, dict):
        events = events.values()
    result = []
    for event in events:
        if not isinstance(event, Event):
            event = Event(event)
        result.append((expression(event.when, L), event.direction, bool(event.terminal)))
    return result
