"""Derivatives of motions of rigid bodies: of rows, events and losses."""

from typing import NamedTuple

import numpy as np

from . import _core

# What a motion of a rigid body depends on, in the order of the core: turns of the initial attitude in the body, the initial angular
# velocity, the initial action, and the parameters.
_START = "turn1", "turn2", "turn3", "omega1", "omega2", "omega3", "z"
_STATE = slice(0, 3), slice(3, 6), 6


class RigidBodySensitivity(NamedTuple):
    """The derivatives of the k rows of a motion of a rigid body with respect to a variable, or to m of them.

    `turn` is that of the attitude as a turn R exp(turn) in the body, in radians; the others are those of the arrays of a
    `RigidBodySolution`. The times of the rows are fixed, except that of a terminal event, at which `end` moves. `event_times` are the
    derivatives of the times of events. `growth` is the largest derivative along the motion divided by the largest one at its end.
    """

    turn: np.ndarray  # (k, 3) or (k, 3, m)
    attitude: np.ndarray  # (k, 4) or (k, 4, m)
    Pi: np.ndarray  # (k, 3) or (k, 3, m)
    omega: np.ndarray  # (k, 3) or (k, 3, m)
    M: np.ndarray  # (k, 3) or (k, 3, m)
    tip: np.ndarray  # (k, 3) or (k, 3, m)
    energy: np.ndarray  # (k,) or (k, m)
    z: np.ndarray  # (k,) or (k, m)
    growth: float
    event_times: list  # of (c,) or (c, m)
    end: "RigidBodySensitivity | None"


def sensitivity(sol, variables, parts):
    """See `RigidBodySolution.sensitivity`; `parts` are the columns of the arrays of a row."""
    from ._sensitivity import names_of_variables

    names, is_one = names_of_variables(variables)
    known = [*_START, *_core.rigid_body_parameters()]
    for name in names:
        if name not in known:
            raise ValueError(f"{name!r} is no variable of a rigid body: the variables are {', '.join(known)}")
    picked = [known.index(name) for name in names]
    pick = picked[0] if is_one else picked
    coordinates, columns, slopes, rates = _derivatives(sol)
    # The end of the motion moves with a terminal event.
    moving = np.zeros(columns.shape[-1])
    terminal = [k for k, event in enumerate(sol._request[5]) if event[2] and len(sol.events[k].t)]
    times = np.split(slopes, np.cumsum([len(of.t) for of in sol.events])[:-1]) if sol.events else []
    if terminal and sol.success:
        moving = times[terminal[0]][-1]
    at_end = columns[-1] + np.outer(rates, moving), coordinates[-1] + np.outer(_rates_of_state(sol, rates), moving)
    growth = float(max(1.0, np.abs(coordinates[..., pick]).max() / max(np.abs(coordinates[-1][..., pick]).max(), np.finfo(float).tiny)))

    def arrays(columns, coordinates, growth, event_times, end):
        of = {name: columns[..., part, :][..., pick] for name, part in parts.items() if name != "t"}
        return RigidBodySensitivity(coordinates[..., :3, :][..., pick], **of, growth=growth, event_times=event_times, end=end)

    k = len(sol.t)
    end = arrays(*at_end, growth, [], None)
    return arrays(columns[:k], coordinates[:k], growth, [of[..., pick] for of in times], end)


def pullback(sol, q=None, v=None, p=None, z=None):
    """See `RigidBodySolution.pullback`."""
    from ._sensitivity import partials

    k = len(sol.t)
    coordinates, columns, _, rates = _derivatives(sol)
    of_q, of_v, of_p = (partials(name, x, (k, 3), 0).reshape(k, 3) for name, x in (("q", q), ("v", v), ("p", p)))
    of_z = partials("z", z, (k,), 0)
    coordinates, columns = coordinates[:k], columns[:k]
    rows = [(of_q, coordinates[:, 0:3]), (of_p, coordinates[:, 3:6]), (of_v, columns[:, 8:11])]
    gradient = sum(np.einsum("ki,kij->j", of, by) for of, by in rows) + of_z @ coordinates[:, 6]
    state = _rates_of_state(sol, rates)
    slope = of_q[-1] @ state[0:3] + of_p[-1] @ state[3:6] + of_v[-1] @ rates[8:11] + of_z[-1] * state[6]
    return _gradient(sol, gradient, slope, None, coordinates)


def value_and_gradient(sol, text):
    """The value of an expression of the columns at the end, and its gradient."""
    coordinates, columns, _, rates = _derivatives(sol)
    value, slopes = _core.rigid_body_expression(text, sol.end._rows[0].tolist())
    slopes = np.array(slopes)
    return value, _gradient(sol, slopes @ columns[-1], slopes @ rates, slopes[0], coordinates)


def _gradient(sol, all, slope, of_time, coordinates):
    """The gradient of a number from its derivatives in all variables, and in the final time."""
    from ._sensitivity import Gradient

    q0, v0, z0 = (all[part] for part in _STATE)
    parameters = dict(zip(_core.rigid_body_parameters(), all[7:].tolist()))
    # Without a torque the motion is that of a shorter time.
    t0 = None if sol._request[0][5] is not None or of_time is None and len(sol.t) > 2 else (of_time or 0.0) - float(slope)
    growth = float(max(1.0, np.abs(coordinates).max() / np.abs(coordinates[-1]).max()))
    return Gradient(q0, v0, None, float(z0), parameters, t0, float(slope), growth)


def _derivatives(sol):
    """The derivatives of the rows, and of the end after them: of the coordinates (k, 7, 21), of the columns (k, 19, 21), of the times of
    events, and the derivatives in time at the end."""
    body, start, t, _, _, events, _ = sol._request
    if not sol.success:
        raise ValueError(f"the motion has no derivatives, since it was not completed: {sol.status}")
    times = sol.t.tolist()
    if not times or times[-1] != sol.t_end:
        times.append(sol.t_end)
    crossings = [(k, at) for k, of in enumerate(sol.events) for at in of.t.tolist()]
    found = _core.rigid_body_sensitivity(body, start, t, sol._way(), events, times, crossings)
    (coordinates, columns, slopes), rates = found
    k, width = len(times), len(_START) + len(_core.rigid_body_parameters())
    return coordinates.reshape(k, 7, width), columns.reshape(k, 19, width), slopes.reshape(-1, width), rates


def _rates_of_state(sol, rates):
    """The derivatives in time of the turn, the momentum and the action at the end, from those of the columns."""
    return np.concatenate([sol.end.omega[0], rates[5:8], rates[18:19]])
