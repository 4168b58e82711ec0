"""Systems from the objects that a user may give as a Lagrangian."""

import difflib
import functools
import re
from types import FunctionType

import numpy as np

from . import _core, _trace

_SYSTEMS = {}
# The number of systems of texts that are cached, so that a text is parsed once.
_MOST = 256


def system(L, coordinates=None, parameters=None, *, n=None):
    """The system of a Lagrangian.

    Parameters
    ----------
    L : function, str, SymPy expression or System
        ``L(t, q, v, z)``, or ``L(t, q, v, z, gamma)`` with a parameter gamma; a formula; the name of a system of the
        catalogue.
    coordinates : list of str, optional
        The names of the coordinates; ``"q[3]"`` stands for three. The default, and the name for functions, is
        ``"q[n]"``.
    parameters : dict of float, optional
        The values of the parameters by name.
    n : int, optional
        The number of coordinates, where they have no names.

    Returns
    -------
    System
    """
    if parameters is not None and not hasattr(parameters, "keys"):
        raise ValueError(f"`parameters` is {parameters!r}; it must give values by name, as in parameters={{\"gamma\": -0.1}}")
    if isinstance(L, _core.System):
        return L.with_parameters(parameters) if parameters else L
    if isinstance(coordinates, str):
        coordinates = [coordinates]
    if isinstance(L, str):
        return _of_text(L, coordinates, parameters, n)
    if type(L) is FunctionType or (callable(L) and not hasattr(L, "free_symbols")):
        coordinates = names(coordinates, n)
        of = (*_velocity_names(tuple(coordinates)), tuple(parameters or ()))
        return _of_text(_trace.formula_of(L, of), coordinates, parameters, n)
    if hasattr(L, "free_symbols"):
        from ._sympy import formula_of_expression

        return _of_text(*formula_of_expression(L, coordinates, parameters), parameters, n)
    raise TypeError(f"L is a {type(L).__name__}; it must be a function, a formula, a SymPy expression or a System")


_velocity_names = functools.lru_cache(256)(
    lambda coordinates: tuple(map(tuple, _core.velocity_names(list(coordinates))))
)


def expression(of, system):
    """The text of an additional expression: itself, or that of a function (t, q, v, z, **parameters)."""
    if isinstance(of, str):
        return of
    if callable(of):
        names = system.coordinates
        return _trace.formula_of(
            of, (names, _core.velocity_names(system.given_coordinates)[1], list(system.parameters))
        )
    raise ValueError(f"{of!r} is not an expression: give a string, or a function of (t, q, v, z)")


def check_parameters(system, given, L, expressions):
    """Rejects parameters that neither the Lagrangian nor an additional expression uses: most are misspelt."""
    known = system.used_parameters
    for name in given:
        if name in known or any(re.search(rf"\b{re.escape(str(name))}\b", text) for text in expressions):
            continue
        own = getattr(L, "__code__", None)
        own = own.co_varnames[: own.co_argcount + own.co_kwonlyargcount][4:] if own is not None else ()
        if name in own:
            continue
        names = sorted({*known, *own})
        near = difflib.get_close_matches(str(name), names, 1)
        hint = f"did you mean {near[0]!r}?" if near else f"the formulas use {', '.join(map(repr, names)) or 'no parameters'}"
        raise ValueError(f"the parameter {name!r} is not used in the Lagrangian, an event or a column: {hint}")


def copied(x):
    """A copy of an array or list of the caller, so that later changes of it do not affect the solution."""
    if isinstance(x, np.ndarray):
        return x.copy()
    return [copied(part) for part in x] if isinstance(x, list) else x


def names(coordinates, n):
    """The names of the coordinates, or the default names."""
    if coordinates is not None:
        return list(coordinates)
    if n is None:
        raise ValueError('`coordinates` is not given: give their names, such as ["x", "y"], or "q[3]" for three')
    return [f"q[{n}]"]


def _of_text(text, coordinates, parameters, n):
    if coordinates is None and text.isidentifier():
        for name, _, coordinates, formula, values, _, _ in _core.catalogue():
            if name == text:
                return system(formula, coordinates, dict(values) | dict(parameters or {}))
    coordinates = names(coordinates, n)
    try:
        key = (text, tuple(coordinates), tuple(parameters.items()) if parameters else ())
        found = _SYSTEMS.get(key)
    except TypeError:
        # A value that cannot be hashed is not a number, and is refused below.
        key = found = None
    if found is None:
        found = _core.System(text, coordinates, parameters)
        if len(_SYSTEMS) >= _MOST:
            _SYSTEMS.clear()
        if key is not None:
            _SYSTEMS[key] = found
    return found
