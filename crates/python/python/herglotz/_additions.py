"""What a system has in addition to its Lagrangian: tables, forces, Rayleigh's function, times of jumps, constraints."""

import functools
import math
from typing import NamedTuple

import numpy as np

from . import _core, _trace

velocity_names = functools.lru_cache(256)(
    lambda coordinates: tuple(map(tuple, _core.velocity_names(list(coordinates))))
)


class Additions(NamedTuple):
    """The additions in the form of the core."""

    tables: tuple = ()  # (name, table)
    forces: tuple = ()  # (coordinate, formula)
    rayleigh: tuple = ()  # formulas
    breaks: tuple = ()  # times
    constraints: tuple = ()  # formulas
    friction: tuple = ()  # (coordinate, sliding, sticking or None, surface or None)

    def plus(self, other):
        """Both; a table that is given twice is kept once."""
        tables = self.tables + tuple(table for table in other.tables if table not in self.tables)
        return Additions(tables, *(mine + more for mine, more in zip(self[1:], other[1:])))


def table(t, y, pieces="linear"):
    """A function of time that is given by samples: a measured or a prescribed drive.

    A table is called with the time, in functions that are traced and elsewhere: ``drive(t)``. In formulas it has the
    name that the argument `tables` of `solve` gives it. Steps end at its samples, where it has kinks or jumps. It is
    constant before the first and after the last sample.

    Parameters
    ----------
    t, y : arrays of shape (k,)
        The times, in ascending order, and the values; at least two.
    pieces : {"linear", "held", "cubic"}
        Straight lines between the samples; values that are held until the next sample; or the cubic spline with a
        continuous third derivative at the second and at the last but one sample.

    Returns
    -------
    Table

    Examples
    --------
    >>> import herglotz as hz
    >>> drive = hz.table([0.0, 1.0, 3.0], [0.0, 2.0, 0.0])
    >>> drive(0.5), drive([0.0, 2.0, 9.0])
    (1.0, array([0., 1., 0.]))
    >>> sol = hz.solve(lambda t, q, v, z: v @ v / 2 - q @ q / 2 + q[0] * drive(t), [0.0], [0.0], 5.0)
    """
    return _core.Table(t, y, pieces)


def additions_of(force, rayleigh, tables, breaks, names, constraints=None, friction=None):
    """The additions from the arguments of `system`, in the names of coordinates, velocities and parameters."""
    found = _checked_tables(tables)
    forces = tuple(_forces_of(force, names, found)) if force is not None else ()
    rayleighs = (text_of("rayleigh", rayleigh, names, found),) if rayleigh is not None else ()
    all_constraints = tuple(_constraints_of(constraints, names, found)) if constraints is not None else ()
    all_friction = tuple(_friction_of(friction, names, found)) if friction is not None else ()
    return Additions(tuple(found.items()), forces, rayleighs, breaks_of(breaks), all_constraints, all_friction)


def _checked_tables(tables):
    if not tables:
        return {}
    if not hasattr(tables, "items"):
        raise ValueError(f'`tables` is {tables!r}; it must give tables by name, as in tables={{"drive": hz.table(t, y)}}')
    for name, given in tables.items():
        if not isinstance(name, str):
            raise ValueError(f"`tables` has the name {name!r}: give names as strings")
        if not isinstance(given, _core.Table):
            raise ValueError(f"tables[{name!r}] is {given!r}; make a table with hz.table(t, y)")
    return dict(tables)


def _forces_of(force, names, tables):
    """The forces by coordinate."""
    coordinates = names[0]
    if hasattr(force, "items"):
        return [(str(coordinate), text_of(f"force[{coordinate!r}]", of, names, tables)) for coordinate, of in force.items()]
    if isinstance(force, str):
        if len(coordinates) != 1:
            raise ValueError(
                f"`force` is one formula, but there are {len(coordinates)} coordinates: give formulas by coordinate, as in "
                f"force={{{coordinates[0]!r}: {force!r}}}"
            )
        return [(coordinates[0], force)]
    if callable(force) and not isinstance(force, _core.Table):
        values = _trace.call_traced(force, names)
        return list(zip(coordinates, _trace.texts_of(values, len(coordinates), "a force", force, names, tables)))
    raise ValueError(
        f"`force` is {force!r}; it must be a function (t, q, v, z), or give formulas by coordinate, as in "
        f'force={{{coordinates[0]!r}: "..."}}'
    )


def _constraints_of(constraints, names, tables):
    """The formulas of constraints: of a text, of a function c(q, **parameters), or of a list of them."""
    if isinstance(constraints, str):
        return [constraints]
    if callable(constraints) and not isinstance(constraints, _core.Table):
        values = _trace.call_of_positions(constraints, names)
        found = np.ravel(np.array(values, dtype=object))
        return [_trace.value_text(value, constraints, names, tables) for value in found]
    if isinstance(constraints, (list, tuple)):
        return [text for constraint in constraints for text in _constraints_of(constraint, names, tables)]
    raise ValueError(
        f"`constraints` is {constraints!r}; it must be a formula such as \"x^2 + y^2 = 1\", a function c(q) that returns a "
        "number or an array, or a list of them"
    )


_FRICTION = 'as in friction={"x": "mu*m*g"}, {"x": ("coulomb", "mu", "m*g")} or {"x": {"sliding": 0.6, "sticking": 1.0, "surface": "u"}}'


def _friction_of(friction, names, tables):
    """The friction on coordinates: its size while they slide, the largest one while they stick, the velocity of the surface."""
    if not hasattr(friction, "items") or not friction:
        raise ValueError(f"`friction` is {friction!r}; it must give friction by coordinate, {_FRICTION}")
    found = []
    for coordinate, of in friction.items():
        text = lambda part, x: text_of(f"friction[{coordinate!r}]{part}", x, names, tables)  # noqa: E731, B023
        if isinstance(of, tuple):
            if len(of) != 3 or of[0] != "coulomb":
                raise ValueError(f"friction[{coordinate!r}] is {of!r}; it must be a formula, {_FRICTION}")
            of = {"sliding": f"({text('', of[1])})*({text('', of[2])})"}
        elif not hasattr(of, "items"):
            of = {"sliding": of}
        if unknown := [key for key in of if key not in ("sliding", "sticking", "surface")]:
            raise ValueError(f"friction[{coordinate!r}] has the entry {unknown[0]!r}; give friction {_FRICTION}")
        if "sliding" not in of:
            raise ValueError(f"friction[{coordinate!r}] has no entry 'sliding'; give friction {_FRICTION}")
        parts = [text(f"[{key!r}]", of[key]) if key in of else None for key in ("sliding", "sticking", "surface")]
        found.append((str(coordinate), *parts))
    return found


def text_of(what, of, names, tables):
    """The formula of a force, of Rayleigh's function or of a new value: of a text, a function or a number."""
    if isinstance(of, str):
        return of
    if isinstance(of, (int, float, np.integer, np.floating)) and not isinstance(of, bool) and math.isfinite(of):
        return repr(float(of))
    if callable(of) and not isinstance(of, _core.Table):
        return _trace.formula_of(of, names, tables)
    raise ValueError(f"`{what}` is {of!r}; it must be a formula, or a function (t, q, v, z)")


def breaks_of(breaks, span=None):
    """The named times of jumps, in ascending order and within the span of a motion."""
    if breaks is None:
        return ()
    try:
        times = np.array(breaks, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"`breaks` is {breaks!r}; it must be a list of times") from None
    if times.ndim != 1:
        raise ValueError(f"`breaks` is {breaks!r}; it must be a list of times, as in breaks=[3.0]")
    for i, time in enumerate(times):
        if not np.isfinite(time):
            raise ValueError(f"`breaks[{i}]` is {time}; it must be a finite number")
        if i > 0 and time <= times[i - 1]:
            raise ValueError(f"`breaks` must increase, but {time} follows {times[i - 1]}")
    if span is not None:
        ends = np.array(span, dtype=float, ndmin=1)
        first, last = (ends[0], ends[-1]) if np.ndim(span) else (0.0, ends[0])
        for time in times:
            if not min(first, last) <= time <= max(first, last):
                raise ValueError(f"`breaks` contains {time}, but the motion runs from {first} to {last}")
    return tuple(map(float, times))


def names_in(coordinates, parameters, kind):
    """The names for a traced function: coordinates, velocities or the momenta of a Hamiltonian, parameters, action."""
    hamiltonian, momenta, action = kind
    names, velocities = velocity_names(tuple(coordinates))
    second = tuple(_core.momentum_names(list(coordinates), list(momenta))) if hamiltonian else velocities
    return names, second, parameters, action


def names_of(system):
    """The same for a system."""
    return names_in(system.given_coordinates, list(system.parameters), system.kind)


LAGRANGIAN = (False, (), "z")
