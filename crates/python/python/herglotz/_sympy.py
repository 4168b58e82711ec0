"""Expressions of SymPy as Lagrangians."""

import functools

import sympy

from . import _trace


def formula_of_expression(L, coordinates, parameters):
    """The formula of an expression, and the names of its coordinates.

    The coordinates are symbols, with velocities named as `xdot`, `x_dot`, `vx`, `v_x` or `Derivative(x(t), t)` of functions of t.
    """
    if coordinates is None:
        coordinates = _functions(L)
    given = [sympy.Symbol(c) if isinstance(c, str) else c for c in coordinates]
    return _text(sympy.sympify(L), tuple(given), tuple(parameters or ())), [_name(c) for c in given]


def _name(coordinate):
    name = coordinate.func.__name__ if isinstance(coordinate, sympy.core.function.AppliedUndef) else coordinate.name
    return "".join(c for c in name if c.isalnum() or c == "_")


def _functions(L):
    """The functions of t in an expression, by name."""
    found = sorted(L.atoms(sympy.core.function.AppliedUndef), key=str)
    if not found:
        raise ValueError("`coordinates` is not given: the symbols that are coordinates, as [x, y]")
    return found


@functools.lru_cache(256)
def _text(L, coordinates, parameters):
    by_name = {symbol.name: symbol for symbol in L.free_symbols}
    velocities, replaced = [], {}
    for coordinate in coordinates:
        name = _name(coordinate)
        velocity = sympy.Dummy(f"v_{name}")
        if isinstance(coordinate, sympy.core.function.AppliedUndef):
            replaced[coordinate.diff(*coordinate.args)] = velocity
        else:
            for written in (f"{name}'", f"{name}dot", f"{name}_dot", f"\\dot{{{name}}}", f"v{name}", f"v_{name}"):
                if written in by_name and written not in parameters:
                    replaced[by_name[written]] = velocity
        velocities.append(velocity)
    L = L.subs(replaced)
    positions = [sympy.Dummy(_name(c)) for c in coordinates]
    L = L.subs(dict(zip(coordinates, positions)))
    t, z = by_name.get("t", sympy.Symbol("t")), by_name.get("z", sympy.Symbol("z"))
    values = [by_name.get(name, sympy.Symbol(name)) for name in parameters]
    unknown = L.free_symbols - {*positions, *velocities, t, z, *values}
    if unknown:
        names = ", ".join(sorted(f"`{symbol}`" for symbol in unknown))
        raise ValueError(
            f"the expression has {names}, neither coordinate nor parameter: give coordinates=[...] and parameters={{...}}; "
            "the velocity of x is `xdot`, or the derivative of x(t)"
        )
    function = sympy.lambdify([t, positions, velocities, z, *values], L, modules="numpy", dummify=True)

    def traced(t, q, v, z, **given):
        return function(t, list(q), list(v), z, *(given[name] for name in parameters))

    names = [_name(c) for c in coordinates]
    velocity_names = [f"{name}'" for name in names]
    return _trace.formula_of(traced, (names, velocity_names, parameters))
