"""Events, and what happens to the state at them."""

from . import _core, _trace
from ._additions import names_of, text_of
from ._system import expression


class Event:
    """A function of time and state whose sign changes are located, and what happens to the state there.

    Parameters
    ----------
    when : str or function
        An expression, in the syntax of formulas: ``"theta"``, ``"x'*y - 1"``; or a function of (t, q, v, z), which is
        traced.
    direction : {"both", "rising", "falling"}
        Which sign changes count, in the direction of the motion.
    terminal : bool
        Whether the first sign change ends the motion.
    reset : function or dict of str, optional
        The state after the sign change, from which the motion continues: a function (t, q, v, z, **parameters) of the
        state before it that returns (q, v), where z remains, or (q, v, z); or formulas of the variables that change,
        ``{"x'": "-0.8*x'"}``. The state must be on the surface or on the side from which the motion comes.
    impact : str or tuple, optional
        In place of a reset, the law of an impact where `when`, a function of time and coordinates, falls to 0. The
        momentum changes along its gradient: ``"elastic"`` conserves the energy; ``("restitution", e)`` multiplies the
        normal velocity by -e; ``("conformal", factor)`` multiplies the contact form by a factor of at most 1. The
        first and the last law are contact transformations.
    rest : function or dict of str, optional
        The state from which the motion continues where resets or impacts accumulate, in the form of `reset`. Without it
        the motion ends there. Where it assigns the velocity of the surface to the one coordinate x on which `when`
        depends, as ``rest={"x'": "0"}`` for ``"x"``, the motion stays on the surface until the force pulls it off, and has the
        coordinate ``contact_x`` in addition: 1 in contact (-1 where `when` was negative before), 0 in flight. Any other
        state must leave the surface, or switch the force off by a coordinate.

    Examples
    --------
    A ball that loses a fifth of its speed at each bounce:

    >>> import herglotz as hz
    >>> floor = hz.Event("x", "falling", reset={"x'": "-0.8*x'"})
    >>> sol = hz.solve("x'^2/2 - 9.81*x", [1.0], [0.0], 3.0, coordinates=["x"], events=floor)
    >>> bounces = sol.events[0]
    >>> bounces.t.shape, bounces.v[0], bounces.after_v[0]
    ((5,), array([-4.42944692]), array([3.54355753]))
    """

    __slots__ = ("when", "direction", "terminal", "reset", "impact", "rest")

    def __init__(self, when, direction="both", terminal=False, reset=None, impact=None, rest=None):
        self.when, self.direction, self.terminal = when, direction, terminal
        self.reset, self.impact, self.rest = reset, impact, rest

    def __repr__(self):
        given = {name: getattr(self, name) for name in ("reset", "impact", "rest")}
        more = "".join(f", {name}={value!r}" for name, value in given.items() if value is not None)
        return f"Event({self.when!r}, {self.direction!r}, terminal={self.terminal}{more})"


def events_of(events, system, tables):
    """The events in the form of the core; the tables in their functions are added to `tables`."""
    if isinstance(events, (str, Event)) or callable(events):
        events = [events]
    elif isinstance(events, dict):
        events = events.values()
    result = []
    for event in events:
        if not isinstance(event, Event):
            event = Event(event)
        text = expression(event.when, system, tables)
        result.append((text, event.direction, bool(event.terminal), _change_of(event, text, system, tables)))
    return result


def texts_of_events(events):
    """All formulas of events in the form of the core."""
    for text, _, _, change in events:
        yield text
        for assignments in (change[0], change[2]) if change is not None else ():
            yield from (value for _, value in assignments or ())


def has_reset(event):
    """Whether the state changes at an event in the form of the core."""
    return event[3] is not None


def coordinates_with(system, events):
    """The names of the coordinates, with those of the modes of resting contact that events in the form of the core add."""
    has_rest = any(change is not None and change[2] is not None for *_, change in events)
    return _core.coordinates_of(system, events) if has_rest else system.coordinates


def _change_of(event, text, system, tables):
    """The change of the state at an event: the reset, the impact with its number, and the state of rest."""
    reset, impact, rest = event.reset, event.impact, event.rest
    if reset is None and impact is None:
        if rest is not None:
            raise ValueError(f"the event {text!r} has a state of rest without a reset or an impact: give one of them")
        return None
    if reset is not None and impact is not None:
        raise ValueError(f"the event {text!r} has a reset and an impact: remove one of the two")
    if event.terminal:
        raise ValueError(f"the event {text!r} is terminal and has {'a reset' if impact is None else 'an impact'}: remove one of the two")
    return (
        None if reset is None else _assignments_of("reset", reset, system, tables),
        None if impact is None else _law_of(impact, text),
        None if rest is None else _assignments_of("rest", rest, system, tables),
    )


def _law_of(impact, text):
    """The name and the number of an impact law."""
    law, *number = (impact,) if isinstance(impact, str) else impact if isinstance(impact, (tuple, list)) else (None,)
    if not isinstance(law, str) or len(number) > 1:
        raise ValueError(
            f'the impact {impact!r} of the event {text!r} must be "elastic", ("restitution", 0.8) or ("conformal", 0.64)'
        )
    return law, *(number or [None])


def _assignments_of(what, given, system, tables):
    """The new values of variables: pairs of a variable and a formula."""
    names = coordinates, velocities, _, action = names_of(system)
    if hasattr(given, "items"):
        return [(str(variable), text_of(f"{what}[{variable!r}]", of, names, tables)) for variable, of in given.items()]
    if not callable(given) or isinstance(given, _core.Table):
        raise ValueError(
            f"the {what} of an event is {given!r}; it must be a function (t, q, v, z) -> (q, v) or (q, v, z), or give "
            f'formulas by variable, as in {what}={{"{velocities[0]}": "-{velocities[0]}"}}'
        )
    found = _trace.call_traced(given, names)
    if not isinstance(found, tuple) or len(found) not in (2, 3):
        raise ValueError(
            f"the {what} {_trace.name_of(given)} returns {found!r}; it must return a tuple (q, v) or (q, v, z)"
        )
    n = len(coordinates)
    q, v = (_trace.texts_of(x, n, name, given, names, tables) for x, name in zip(found, ("q", "v")))
    z = [_trace.value_text(found[2], given, names, tables)] if len(found) == 3 else []
    # Variables that keep their values are not assigned.
    pairs = zip((*coordinates, *velocities, action), (*q, *v, *z))
    return [(variable, text) for variable, text in pairs if text != variable]
