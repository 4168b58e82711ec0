"""SymPy expressions as Lagrangians."""

import functools

import sympy

from . import _trace


def formula_of_expression(L, coordinates, parameters):
    """The formula of an expression, and the names of its coordinates.

    The coordinates are symbols, whose velocities are `xdot`, `x_dot`, `vx` or `v_x`, or functions of t, with
    `Derivative(x(t), t)`.
    """
    L = sympy.sympify(L)
    functions = _functions(L)
    if coordinates is None:
        if not functions:
            raise ValueError("`coordinates` is not given: give the symbols that are coordinates, such as [x, y]")
        coordinates = [f for f in functions if f.has(sympy.Symbol("t")) and any(d.expr == f for d in L.atoms(sympy.Derivative))]
        if len(coordinates) < len(functions):
            others = _shown(f for f in functions if f not in coordinates)
            raise ValueError(
                f"the expression has the functions {_shown(functions)}, some of them without a velocity: give those that are coordinates, "
                f"as in coordinates=[{_shown(coordinates or functions[:1])}], and write {others} out as expressions of t"
            )
    given = [sympy.Symbol(c) if isinstance(c, str) else c for c in coordinates]
    _check(L, given, functions)
    return _text(L, tuple(given), tuple(parameters or ())), [_name(c) for c in given]


def _name(coordinate):
    name = coordinate.func.__name__ if isinstance(coordinate, sympy.core.function.AppliedUndef) else coordinate.name
    return "".join(c for c in name if c.isalnum() or c == "_")


def _functions(L):
    """The functions of t in an expression, sorted by name."""
    return sorted(L.atoms(sympy.core.function.AppliedUndef), key=str)


def _shown(expressions):
    return ", ".join(str(x) for x in expressions)


def _check(L, coordinates, functions):
    """Rejects second derivatives and functions that are not coordinates; the error says what to give instead."""
    named = [f for f in functions if any(not isinstance(c, sympy.core.function.AppliedUndef) and _name(c) == _name(f) for c in coordinates)]
    if named:
        raise ValueError(
            f"the coordinates of the expression are the functions {_shown(named)}, not symbols of their names: give "
            f"coordinates=[{_shown(named)}]"
        )
    for derivative in L.atoms(sympy.Derivative):
        if derivative.expr in coordinates and derivative.derivative_count > 1:
            raise ValueError(
                f"{derivative} is a second derivative, on which a Lagrangian cannot depend: write L in terms of "
                f"{derivative.expr} and its first derivative"
            )
    for f in functions:
        if f not in coordinates and _name(f) == "z":
            raise ValueError(f"the expression uses {f} for the action: use the symbol `z`, whose time derivative is L itself")
    others = [f for f in functions if f not in coordinates]
    if others:
        names = ", ".join(f"`{f}`" for f in others)
        raise ValueError(
            f"the expression contains {names}, neither coordinate nor known function: write it out as an expression of t, or give it as a "
            "coordinate"
        )


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
            f"the expression contains {names}, neither coordinate nor parameter: give coordinates=[...] and parameters={{...}}; "
            "the velocity of x is `xdot`, or the derivative of x(t)"
        )
    function = sympy.lambdify([t, positions, velocities, z, *values], L, modules="numpy", dummify=True)

    def traced(t, q, v, z, **given):
        return function(t, list(q), list(v), z, *(given[name] for name in parameters))

    names = [_name(c) for c in coordinates]
    velocity_names = [f"{name}'" for name in names]
    return _trace.formula_of(traced, (names, velocity_names, parameters), {})
