"""Derivatives of motions: forward, and by the adjoint."""

from typing import NamedTuple

import numpy as np

from . import _core
from ._arguments import Arguments
from ._body import RigidBody
from ._solve import request_of, solve
from ._watch import watch_of


class EndSensitivity(NamedTuple):
    """The derivatives of the state that a motion has reached, `Solution.end`; see `Sensitivity`."""

    q: np.ndarray  # (n,) or (n, m)
    v: np.ndarray  # (n,) or (n, m)
    p: np.ndarray  # (n,) or (n, m)
    z: np.ndarray  # () or (m,)


class Sensitivity(NamedTuple):
    """The derivatives of the k rows of a motion with respect to a variable, or to m of them; see `Solution.sensitivity`.

    The times of the rows are fixed, except that of the final time where it is the variable, and that of a terminal event,
    with which the end moves. `event_times` are the derivatives of the times of events and resets, a list or dict as
    `Solution.events`, each of shape (c,) or (c, m). Derivatives in the start are
    those in the state at `t0`, where this motion starts: a motion from `Solution.resume` starts at the end of the one
    before. Round-off of the derivatives is amplified by `growth`, the largest derivative along the motion divided by the
    largest one at its end, at least one.
    """

    q: np.ndarray  # (k, n) or (k, n, m)
    v: np.ndarray  # (k, n) or (k, n, m)
    p: np.ndarray  # (k, n) or (k, n, m)
    z: np.ndarray  # (k,) or (k, m)
    growth: float
    t0: float
    event_times: list | dict  # of (c,) or (c, m)
    end: EndSensitivity


class Gradient(NamedTuple):
    """The gradient of a number that depends on a motion; see `Solution.pullback` and `value_and_grad`.

    It is the derivative with respect to `v0` where the start was given by its velocity, then `p0` is None, and with
    respect to `p0` where it was given by its momentum. In `t0` the final time is fixed, and in both times the number of
    steps. Round-off is amplified by `growth`, the largest derivative along the motion divided by that at its start, at
    least one. `unresolved` is that of the motion, as `Solution.unresolved`.
    """

    q0: np.ndarray  # (n,)
    v0: np.ndarray | None  # (n,)
    p0: np.ndarray | None  # (n,)
    z0: float
    parameters: dict
    t0: float | None  # None for some of a rigid body
    t_end: float
    growth: float
    unresolved: str | None = None


class LyapunovExponents(NamedTuple):
    """The Lyapunov exponents of a motion: the mean growth rates of its tangent in (q, p, z), those of the discrete motion.

    ``pairs`` has those of the directions of the position and the momentum of each coordinate; with ``rate``, the mean of
    ln(sigma_d)/h, they are all exponents where L_z is constant. ``pairing_defect`` is the largest distance of the sum of a
    pair from the rate, or None where L_z is not constant, a force acts, or a reset is not contact; ``volume_defect`` is that
    of the sum of all from n + 1 times the rate, or None where a force acts or a reset is not contact. Both are round-off;
    where the first is not, a warning says so.
    """

    exponents: np.ndarray  # (2n + 1,), in descending order
    of_second_half: np.ndarray  # (2n + 1,), in the same order
    pairs: np.ndarray  # (n, 2)
    rate: float
    pairing_defect: float | None
    volume_defect: float | None


def lyapunov_exponents(sol):
    """See `Solution.lyapunov_exponents`."""
    _check(sol)
    return LyapunovExponents(*_core.lyapunov_exponents(_core.Motion(sol.system, *sol._request)))


def names_of_variables(variables):
    """The names of an argument `variables`, and whether it is a single one."""
    is_one = isinstance(variables, str)
    names = [variables] if is_one else list(variables)
    if not all(isinstance(name, str) for name in names):
        raise ValueError(f"`variables` is {variables!r}; it must be a name, such as \"gamma\", or a list of names")
    return names, is_one


def sensitivity(sol, variables):
    """See `Solution.sensitivity`."""
    names, is_one = names_of_variables(variables)
    _check(sol)
    times, events = sol.t.tolist(), sol.events
    if not times or times[-1] != sol.t_end:
        times.append(sol.t_end)
    of_events = list(events.values() if isinstance(events, dict) else events)
    crossings = [(i, t) for i, of in enumerate(of_events) for t in of.t.tolist()]
    (q, v, p), z, growth, slopes = _core.sensitivity(_core.Motion(sol.system, *sol._request), names, times, crossings)
    shape = len(times), len(names), len(sol._coordinates)
    q, v, p = (x.reshape(shape).transpose(0, 2, 1) for x in (q, v, p))
    z, slopes = z.reshape(shape[:2]), slopes.reshape(len(crossings), len(names))
    if is_one:
        q, v, p, z, slopes = q[:, :, 0], v[:, :, 0], p[:, :, 0], z[:, 0], slopes[:, 0]
    event_times = np.split(slopes, np.cumsum([len(of.t) for of in of_events])[:-1]) if of_events else []
    if isinstance(events, dict):
        event_times = dict(zip(events, event_times))
    end, k = EndSensitivity(q[-1], v[-1], p[-1], z[-1]), len(sol.t)
    return Sensitivity(q[:k], v[:k], p[:k], z[:k], growth, start_time(sol._request), event_times, end)


def start_time(request):
    """The time of the start of a request."""
    t = np.atleast_1d(np.asarray(request[1], dtype=float))
    return float(t[0]) if np.ndim(request[1]) else 0.0


def pullback(sol, q=None, v=None, p=None, z=None):
    """See `Solution.pullback`."""
    k, n = len(sol.t), len(sol._coordinates)
    _check(sol)
    parts = [partials(name, x, (k, n), 0).tolist() for name, x in (("q", q), ("v", v), ("p", p))]
    motion = _core.Motion(sol.system, *sol._request)
    return _gradient(sol.system, sol._request, _core.pullback(motion, sol.t.tolist(), parts, partials("z", z, (k,), 0).tolist()))


def partials(name, x, whole, axis):
    """Partial derivatives in rows, which are along an axis, as a vector; those in the last row only where it is not given."""
    found = np.zeros(whole)
    if x is None:
        return found.ravel()
    given = np.asarray(x, dtype=float)
    last = whole[:axis] + whole[axis + 1 :]
    if given.shape == last:
        found[(slice(None),) * axis + (-1,)] = given
    elif given.shape == whole:
        found[:] = given
    else:
        raise ValueError(f"`{name}` has the shape {given.shape}; it must be {whole}, that of the rows, or {last} for the last row")
    if not np.isfinite(found).all():
        raise ValueError(f"`{name}` is not finite; give finite partial derivatives")
    return found.ravel()


def value_and_grad(loss):
    """A function that runs a motion, and returns the value of a loss of its final state with the gradient.

    The gradient is computed by the adjoint of the steps that were taken: it is that of the discrete motion, to round-off,
    at the cost of a few runs for any number of variables. A loss of several rows, or one that is not written as an
    expression, is differentiated with `Solution.pullback`.

    Parameters
    ----------
    loss : str or function
        An expression of the final state, as in the argument `observe` of `solve`: a formula, or a function ``(t, q, v, z,
        **parameters)`` that is called once with tracers. It may depend on the parameters explicitly.

    Returns
    -------
    function
        It takes the arguments of `solve` that determine a motion, events with resets among them, and returns the value, a
        float, and a `Gradient`. Of the times `t` it uses the first and the last.

    Raises
    ------
    ValueError
        By the function: for an invalid argument, an integrator whose tangent is not implemented, and a motion that is
        not completed, with its status.

    Examples
    --------
    >>> import herglotz as hz
    >>> miss = hz.value_and_grad(lambda t, q, v, z, target: (q[0] - target) ** 2)
    >>> value, gradient = miss("pendulum", [1.0], [0.0], 10.0, parameters={"gamma": -0.1, "target": 0.5})
    >>> sorted(gradient.parameters)
    ['gamma', 'target']
    """

    def run(*arguments, **named):
        given = _SOLVE.bind(arguments, named)
        refuse_of_rows(given, "a loss is a number of the final state, and has no rows", "observe", "every", "conformal_factor", "estimate", "exact")
        refuse_of_rows(given, "a value and its gradient are computed in one call", "progress", "callback")
        watch_of(given)
        if isinstance(given["L"], RigidBody):
            return given["L"]._value_and_grad(loss, given)
        # As a column it is traced, and its parameters and tables are found.
        of, request, *_ = request_of(**given | {"observe": {"loss": loss}})
        (text,) = request[5]
        value, slopes = _core.value_and_gradient(_core.Motion(of, *request[:5], [], *request[6:]), text)
        return value, _gradient(of, request, slopes)

    return run


_SOLVE = Arguments(solve)


def refuse_of_rows(given, why, *names):
    """Refuses arguments that concern rows only, which would have no effect."""
    for name in names:
        if given.get(name):
            raise ValueError(f"`{name}` cannot be given here: {why}; remove it")


def _gradient(system, request, slopes):
    q0, velocity, z0, parameters, t0, t_end, growth, unresolved = slopes
    is_momentum = request[0][2]
    v0, p0 = (None, velocity) if is_momentum else (velocity, None)
    return Gradient(q0, v0, p0, z0, dict(zip(system.parameters, parameters)), t0, t_end, growth, unresolved)


def _check(sol):
    if not sol.success:
        raise ValueError(f"the motion has no derivatives, since it was not completed: {sol.status}")
