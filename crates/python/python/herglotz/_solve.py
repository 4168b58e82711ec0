"""One motion: its request and its run."""

import numpy as np

from . import _core
from ._additions import breaks_of
from ._events import events_of, texts_of_events
from ._method import integrator_of
from ._solution import Interrupted, Solution
from ._system import Composed, check_used, copied, expression, system_of, warn_of_gain, with_tables
from ._watch import NOTHING, watch_of


def solve(
    L=None,
    q0=None,
    v0=None,
    t=None,
    *,
    H=None,
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
    exact=False,
    scales=None,
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
    project=False,
    progress=False,
    callback=None,
    callback_interval=1.0,
):
    """The motion of a Lagrangian system: Herglotz' equation, d/dt L_v = L_q + L_z L_v with dz/dt = L.

    Or that of a contact Hamiltonian: q' = H_p, p' = -H_q - p H_z, z' = p.H_p - H.

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
    H : function or str, optional
        In place of `L`, a contact Hamiltonian ``H(t, q, p, z)`` or its formula, as in `system`. It starts from `p0`, or
        from `v0` where H_pp is regular, and runs by a Gauss method.
    p0 : array of shape (n,), optional
        The initial momentum, in place of `v0`.
    z0 : float
        The initial action.
    accuracy : float, optional
        The requested error, by default 1e-9: that of (q, p) relative to its size, and that of v relative to the largest
        speed. The step is chosen for it, and also the integrator where none is named.
    integrator : str or Method, optional
        One of the names that `integrators` returns, or a discrete Lagrangian of one's own; see `method`.
    step, steps : float, int, optional
        The length or the number of steps of `integrator`, in place of an accuracy.
    every : int, optional
        Record a row every `every` steps, in place of the rows at `t`.
    events : str, Event, or a list or dict of them
        Functions of time and state whose sign changes are located, and resets that occur at them.
    observe : dict of str or functions, optional
        Expressions by name: additional columns, ``sol["name"]``.
    conformal_factor : bool
        Whether `Solution.log_factor` is computed.
    estimate : bool
        Whether `Solution.error_estimate` is computed. For given steps it takes a second run with steps of half the
        length, which costs twice as much as the first.
    exact : bool
        Whether rows and events within steps are computed by steps of the integrator that end there, so that the map to
        each of them is contact. Otherwise they are on polynomials, which are as accurate and take less time.
    scales : array of shape (n,), optional
        The size of each coordinate, where they differ much or have different units: `accuracy` and `estimate` then
        apply to each coordinate and its velocity in units of its size.
    coordinates, parameters
        As in `system`.
    force, rayleigh, tables
        As in `system`. With a force f the equation of motion is d/dt L_v - L_q - L_z L_v = f, and the flow is not
        contact: ``sol.plan`` says what is lost.
    breaks : list of float, optional
        Times of jumps within the span, in ascending order: steps end there. Those that the formulas show, as samples of
        tables and ``np.where(t < 3, ...)``, are known without it.

    momenta, action, constraints, friction
        As in `system`. ``observe={"tension": "lambda[0]"}`` records the multiplier of the first constraint, whose force is
        the multiplier times its gradient.
    project : bool
        Whether a start that violates the constraints is moved to them; otherwise it is refused, with its distance.
    progress : bool
        Whether the progress is shown: by tqdm, where it is installed, else by a line on standard error.
    callback : function, optional
        Called during the run as ``callback(sol)`` with the solution so far, whose last row is the present state; its
        `steps` and `evaluations` are None. Where it returns True the run is stopped, and `Solution.resume` continues it.
    callback_interval : float
        The seconds between two calls of `callback`.

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
    arguments = locals()
    if isinstance(L, Composed):
        return L._solve(arguments)
    watch = watch_of(arguments)
    return run(*request_of(**arguments), watch=watch)


def request_of(
    L,
    q0,
    v0,
    t,
    p0,
    z0,
    accuracy,
    integrator,
    step,
    steps,
    every,
    events,
    observe,
    conformal_factor,
    estimate,
    scales,
    coordinates,
    parameters,
    force,
    rayleigh,
    tables,
    breaks,
    H=None,
    momenta=None,
    action=None,
    constraints=None,
    friction=None,
    project=False,
    exact=False,
    also=(),
):
    """The system and the request for the arguments of `solve`, with the names of the events and of the columns.

    Parameters and tables may be used in the formulas of `also`.
    """
    given = (L if H is None else H, *functions_of(force, rayleigh))
    more = force, rayleigh, tables, breaks, constraints, friction
    kind = H, momenta, action
    if type(L) is not _core.System or parameters is not None or q0 is None or any(
        x is not None for x in (coordinates, *more, *kind)
    ):
        L, q0, v0 = system_and_start(L, q0, v0, p0, coordinates, parameters, more, kind)
    if t is None:
        raise ValueError("`t` is not given: give the final time, or the times of the rows")
    if (v0 is None) == (p0 is None):
        raise ValueError("give either `v0` or `p0`")
    if breaks is not None:
        breaks_of(breaks, t)
    found = {}
    given_events = events_of(events, L, found) if events else []
    columns = columns_of(observe, L, found)
    L = with_tables(L, found)
    request = (
        (copied(q0), copied(v0), False, z0, None) if p0 is None else (copied(q0), copied(p0), True, z0, None),
        copied(t),
        every,
        (accuracy, integrator_of(integrator, L), step, steps),
        given_events,
        columns,
        conformal_factor,
        estimate,
        copied(scales),
        project,
        exact,
    )
    if parameters or tables:
        check_used(L, parameters, tables, given, [*texts_of_events(given_events), *columns, *also])
    if "gamma" in L.parameters:
        warn_of_gain(L, q0, v0 if p0 is None or not L.kind[0] else p0, z0, t[0] if np.ndim(t) and np.size(t) else 0.0)
    event_names = tuple(events) if isinstance(events, dict) else len(request[4])
    return L, request, event_names, tuple(observe) if observe else ()


def run(L, request, event_names, observed, halted=None, watch=NOTHING):
    """The solution of a request, or the remaining part of an interrupted one."""

    def solution(record):
        return Solution(L, request, record, event_names, observed)

    motion = _core.Motion(L, *request)

    def call(watched):
        return _core.run(motion, watched) if halted is None else _core.resume(motion, *halted, watched)

    record = watch.run(call, solution)
    sol = solution(record)
    if record.interrupted is not None:
        if isinstance(record.interrupted, KeyboardInterrupt):
            raise Interrupted(sol)
        raise record.interrupted
    return sol


def system_and_start(L, q0, v0, p0, coordinates, parameters, more=(None,) * 5, kind=(None,) * 3):
    """The system of an argument, and the start, which the catalogue may provide."""
    if L is None and kind[0] is None:
        raise ValueError("give either `L` or `H`")
    if isinstance(L, str) and L in CATALOGUE and kind[2] is None:
        entry = CATALOGUE[L]
        if q0 is None and v0 is None and p0 is None:
            q0, v0 = entry[5], entry[6]
    if isinstance(L, Composed):
        L, parameters = L._with(parameters)
        L = L.system
    if q0 is None:
        raise ValueError("`q0` is not given: give the initial position")
    n = len(q0) if hasattr(q0, "__len__") else 1
    force, rayleigh, tables, breaks, *others = more
    constraints, friction = others or (None, None)
    H, momenta, action = kind
    names = dict(H=H, momenta=momenta, action=action, constraints=constraints, friction=friction)
    of = system_of(L, coordinates, parameters, n=n, force=force, rayleigh=rayleigh, tables=tables, breaks=breaks, **names)
    return of, q0, v0


def functions_of(force, rayleigh):
    """The functions of forces, whose parameters may be given."""
    return (*(force.values() if hasattr(force, "values") else [force]), rayleigh)


CATALOGUE = {entry[0]: entry for entry in _core.catalogue()}


def columns_of(observe, L, tables):
    """The texts of the observed expressions."""
    if not observe:
        return []
    if not hasattr(observe, "values"):
        raise ValueError(f'`observe` is {observe!r}; it must give expressions by name, as in observe={{"square": "x^2"}}')
    return [expression(column, L, tables) for column in observe.values()]
