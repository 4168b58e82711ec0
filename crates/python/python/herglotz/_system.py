"""Systems from the objects that a user may give as a Lagrangian."""

import difflib
import re
import sys
import warnings
from types import FunctionType

import numpy as np

from . import _core, _trace
from ._additions import LAGRANGIAN, Additions, additions_of, names_in, names_of

_SYSTEMS = {}
# The number of systems of texts that are cached, so that a text is parsed once.
_MOST = 256


class Composed:
    """An object in place of a Lagrangian: `solve` calls its `_solve`, and other functions use its formula, `system`."""

    def _with(self, parameters):
        """The same with those of the parameters that it has, and the others, which events, columns and forces may have."""
        given = dict(parameters or {})
        own = {name: x for name, x in given.items() if name in self.parameters}
        return (self.with_parameters(own) if own else self), {name: x for name, x in given.items() if name not in own} or None


def is_absent(x):
    """Whether an argument has the value that it has by default where nothing is requested."""
    return x is None or x is False or isinstance(x, tuple) and not x


def system(
    L=None,
    coordinates=None,
    parameters=None,
    *,
    H=None,
    momenta=None,
    action=None,
    n=None,
    force=None,
    rayleigh=None,
    tables=None,
    breaks=None,
    constraints=None,
    friction=None,
):
    """The system of a Lagrangian, or of a contact Hamiltonian.

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
    H : function or str, optional
        In place of `L`, a contact Hamiltonian: ``H(t, q, p, z)``, or a formula in the coordinates ``x`` and the momenta
        ``p_x``. Its motions satisfy q' = H_p, p' = -H_q - p H_z, z' = p.H_p - H; H_pp may be singular. It has up to 4
        coordinates, and no forces and resets.
    momenta : list of str, optional
        The names of the momenta of `H` in formulas, in the order of the coordinates.
    action : str, optional
        The name of the action in formulas, by default ``"z"``; with another one ``z`` may be a coordinate.
    n : int, optional
        The number of coordinates, where they have no names.
    force : function, dict of str, or str, optional
        The force f(t, q, v, z) on the coordinates: the motions then satisfy d/dt L_v - L_q - L_z L_v = f, dz/dt = L. A
        function (t, q, v, z, **parameters) that returns an array of shape (n,), or a number for one coordinate; or
        formulas by coordinate, ``{"x": "-c*x'*abs(x')"}``; or the formula for a single coordinate. With a force the
        flow is not contact.
    rayleigh : function or str, optional
        Rayleigh's function R(t, q, v, z), whose force -dR/dv is added.
    tables : dict of Table, optional
        Tables by the names that they have in formulas: ``tables={"drive": table}`` for ``drive(t)``. Functions call
        their tables without this argument.
    breaks : list of float, optional
        Times at which steps end, in ascending order: those of jumps that the formulas do not show as such.
    constraints : str, function, or a list of them, optional
        Holonomic constraints: equations over the coordinates and parameters, ``"x^2 + y^2 = l^2"``, or functions
        ``c(q)`` or ``c(q, l)`` that vanish, each of which returns a number or an array. The motion is that on the
        surface where they hold. The names of Gauss methods then stand for contact Lobatto methods of the same order, and
        those of splittings for RATTLE composed by their schemes. Up to 8 coordinates.
    friction : dict, optional
        Dry friction by coordinate, which sticks and slips by itself: the size of the force while the coordinate slides, a
        formula or a function, as in ``{"x": "mu*m*g"}``; ``("coulomb", mu, N)``; or a dict of ``"sliding"``, of
        ``"sticking"``, the largest force that holds it while it sticks, and of ``"surface"``, the velocity of the surface, a
        function of time. The motion has one coordinate more for each, ``slip_x``: 0 while x sticks, 1 and -1 while it slips,
        the direction of the force.

    Returns
    -------
    System
    """
    made = system_of(
        L, coordinates, parameters, H=H, momenta=momenta, action=action, n=n, force=force, rayleigh=rayleigh, tables=tables,
        breaks=breaks, constraints=constraints, friction=friction,
    )  # fmt: skip
    if n is not None and n != made.dimension:
        raise ValueError(f"`n` is {n!r}, but the system has {made.dimension} coordinates: remove it")
    return made


def system_of(
    L=None,
    coordinates=None,
    parameters=None,
    *,
    H=None,
    momenta=None,
    action=None,
    n=None,
    force=None,
    rayleigh=None,
    tables=None,
    breaks=None,
    constraints=None,
    friction=None,
):
    """See `system`; here `n` is the number of coordinates without names, and does not matter otherwise."""
    if parameters is not None and not hasattr(parameters, "keys"):
        raise ValueError(f"`parameters` is {parameters!r}; it must give values by name, as in parameters={{\"gamma\": -0.1}}")
    if (L is None) == (H is None):
        raise ValueError("give either `L` or `H`")
    if isinstance(L, Composed):
        L, parameters = L._with(parameters)
        L = L.system
    if momenta is not None and H is None:
        raise ValueError("`momenta` are names for `H`: remove them, or give `H`")
    if isinstance(momenta, str):
        momenta = [momenta]
    if action is not None and not isinstance(action, str):
        raise ValueError(f'`action` is {action!r}; it must be a name, as in action="s"')
    given = L if H is None else H
    if isinstance(given, _core.System) and (H is not None or action is not None):
        raise ValueError("a System has its names already: give it as `L`, without `H` and `action`")
    kind = (H is not None, tuple(momenta or ()), "z" if action is None else action)
    is_plain = not tables and all(x is None for x in (force, rayleigh, breaks, constraints, friction))
    if isinstance(L, _core.System):
        own = [coordinates] if isinstance(coordinates, str) else coordinates
        if own is not None and list(own) not in (L.coordinates, L.given_coordinates):
            raise ValueError(f"a System has its names already, {', '.join(L.coordinates)}: remove `coordinates`")
        if is_plain:
            return L.with_parameters(parameters) if parameters else L
        text, coordinates, known = L.lagrangian, L.given_coordinates, L.parameters
        parameters = known | dict(parameters or {})
        more = Additions(tuple(L.tables), tuple(L.forces), tuple(L.rayleigh), tuple(L.breaks), tuple(L.constraints), tuple(L.friction))
        kind = (L.kind[0], tuple(L.kind[1]), L.kind[2])
    else:
        found = {}
        text, coordinates, parameters = _text_of(given, coordinates, parameters, n, found, kind)
        more = Additions(tuple(found.items()))
    if not is_plain:
        of = names_in(coordinates, tuple(parameters or ()), kind)
        more = more.plus(additions_of(force, rayleigh, tables, breaks, of, constraints, friction))
    return _built(text, coordinates, parameters, more, kind)


def _text_of(L, coordinates, parameters, n, tables, kind):
    """The formula of a Lagrangian, the coordinates and the parameters; the tables in it are added to `tables`."""
    if isinstance(coordinates, str):
        coordinates = [coordinates]
    if isinstance(L, str):
        if coordinates is None and L.isidentifier() and not kind[0]:
            for name, _, coordinates, formula, values, _, _ in _core.catalogue():
                if name == L:
                    return formula, coordinates, dict(values) | dict(parameters or {})
            coordinates = None
        return L, names(coordinates, n), parameters
    if type(L) is FunctionType or (callable(L) and not hasattr(L, "free_symbols")):
        coordinates = names(coordinates, n)
        of = names_in(coordinates, tuple(parameters or ()), kind)
        return _trace.formula_of(L, of, tables), coordinates, parameters
    if hasattr(L, "free_symbols") and kind == LAGRANGIAN:
        from ._sympy import formula_of_expression

        return *formula_of_expression(L, coordinates, parameters), parameters
    if kind != LAGRANGIAN:
        letter = "H" if kind[0] else "L"
        raise TypeError(f"{letter} is a {type(L).__name__}; it must be a function or a formula")
    raise TypeError(f"L is a {type(L).__name__}; it must be a function, a formula, a SymPy expression or a System")


def expression(of, system, tables):
    """The text of an additional expression: itself, or that of a function (t, q, v, z, **parameters).

    The tables in a function are added to `tables`.
    """
    if isinstance(of, str):
        return of
    if callable(of):
        return _trace.formula_of(of, names_of(system), tables)
    raise ValueError(f"{of!r} is not an expression: give a string, or a function of (t, q, v, z)")


def with_tables(of, tables):
    """The system with tables of traced events and columns in addition to its own."""
    known = {name for name, _ in of.tables} if tables else ()
    more = {name: table for name, table in tables.items() if name not in known}
    return system_of(of, tables=more) if more else of


def check_used(system, parameters, tables, functions, expressions):
    """Rejects parameters and tables that neither the Lagrangian, a force nor an additional expression uses: most are misspelt."""
    if parameters:
        _check_parameters(system, parameters, functions, expressions)
    if tables:
        texts = [system.lagrangian, *(text for _, text in system.forces), *system.rayleigh, *system.constraints, *friction_texts(system), *expressions]
        for name in tables:
            if not any(re.search(rf"\b{re.escape(name)}\s*\(", text) for text in texts):
                raise ValueError(
                    f"the table {name!r} is not used in the Lagrangian, a force, an event or a column: write {name}(t) there, "
                    "or remove the table"
                )


def friction_texts(system):
    """The formulas of friction."""
    return [text for _, *parts in system.friction for text in parts if text is not None]


def _check_parameters(system, given, functions, expressions):
    known = system.used_parameters
    codes = [getattr(function, "__code__", None) for function in functions]
    own = [
        name
        for code in codes
        if code is not None
        for name in code.co_varnames[: code.co_argcount + code.co_kwonlyargcount][4:]
    ]
    for name in given:
        if name in known or any(re.search(rf"\b{re.escape(str(name))}\b", text) for text in expressions):
            continue
        if name in own:
            continue
        names = sorted({*known, *own})
        near = difflib.get_close_matches(str(name), names, 1)
        hint = f"did you mean {near[0]!r}?" if near else f"the formulas use {', '.join(map(repr, names)) or 'no parameters'}"
        raise ValueError(f"the parameter {name!r} is not used in the Lagrangian, a force, an event or a column: {hint}")


_GAIN = "so that the motion gains energy: for a drag the rate is negative, as in gamma=-0.1 beside gamma*z"


def warn_of_positive(gamma):
    """Warns of a positive rate, which most who give it want to be a drag."""
    if isinstance(gamma, (int, float)) and gamma > 0:
        warnings.warn(f"gamma is {gamma}, {_GAIN}", stacklevel=_level())


def warn_of_gain(of, q, rate=None, z=0.0, t=0.0, values=None):
    """Warns of a system whose parameter gamma is positive and makes L_z, or -H_z, positive at a point."""
    gamma = of.parameters.get("gamma") if values is None else np.max(values)
    if gamma is None or not gamma > 0:
        return
    if values is not None:
        of = of.with_parameters({"gamma": float(gamma)})
    rate = np.zeros(np.size(q)) if rate is None else rate
    try:
        at = float(t), np.ravel(q), np.ravel(rate), float(z)
        found = (_core.hamiltonian_geometry if of.kind[0] else _core.geometry)(of, at)["rate"]
    except (TypeError, ValueError):
        # Wrong arguments are refused by the function that was called. Where the geometry is not defined, L_z is not known.
        return
    if found > 0:
        name = "-H_z" if of.kind[0] else "L_z"
        warnings.warn(f"gamma is {gamma:g} and {name} is {found:g} at the start, {_GAIN}", stacklevel=_level())


def _level():
    """The level of the stack of the first caller outside of the package."""
    level, frame = 1, sys._getframe(1)
    while frame is not None and frame.f_globals.get("__name__", "").partition(".")[0] == "herglotz":
        level, frame = level + 1, frame.f_back
    return level


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


def _built(text, coordinates, parameters, more, kind):
    try:
        key = (text, tuple(coordinates), tuple(parameters.items()) if parameters else (), more, kind)
        found = _SYSTEMS.get(key)
    except TypeError:
        # A value that cannot be hashed is not a number, and is refused below.
        key = found = None
    if found is None:
        found = _core.System(text, list(coordinates), parameters, *map(list, more), kind)
        if len(_SYSTEMS) >= _MOST:
            _SYSTEMS.clear()
        if key is not None:
            _SYSTEMS[key] = found
    return found
