"""Discrete Lagrangians of the user as integrators."""

import numpy as np

from . import _core, _trace
from ._additions import names_of


class Method:
    """A discrete Lagrangian as an integrator, made by `method`; `name`, `order` and `symmetric` are its properties."""

    __slots__ = ("function", "order", "name", "symmetric")

    def __init__(self, function, order, name, symmetric):
        self.function, self.order, self.name, self.symmetric = function, order, name, symmetric

    def __repr__(self):
        return f"<Method {self.name}, order {self.order}>"

    def _of(self, system):
        """The discrete Lagrangian of a system, in the form of the core."""
        if system.kind[0]:
            raise ValueError(f"the method {self.name!r} is a discrete Lagrangian, and takes no Hamiltonian: give a Lagrangian")
        coordinates, velocities, parameters, action = names_of(system)
        n, step = len(coordinates), "h"
        while step in (*coordinates, *parameters, action):
            step += "_"
        t, q0, q1, z0, values = _core.symbols(n, len(parameters) + 1)
        *values, h = values

        def lagrangian(t, q, v, z):
            q, v = (list(np.ravel(np.array(x, dtype=object))) for x in (q, v))
            return _core.lagrangian_at(system, h, t, q, v, z, values)

        given = _trace._given(self.function, parameters, values, 6)
        found = _trace._called(self.function, lagrangian, t, _trace._vector(q0), _trace._vector(q1), z0, h, **given)
        tables = {}
        text = _trace.value_text(found, self.function, (coordinates, velocities, [*parameters, step], action), tables)
        if tables:
            raise ValueError(f"the method {self.name!r} contains a table; write the samples as a formula")
        values = {**system.parameters, step: 1.0}
        of = _core.System(text, system.given_coordinates, values, kind=(False, [], action))
        return _core.Method(of, step, self.name, self.order, self.symmetric)


def method(function, order, *, name=None, symmetric=False):
    """A discrete Lagrangian of one's own as an integrator: `solve`, `check` and `compare` take it in place of a name.

    Its steps are those of the discrete Herglotz equations, and conformally contact, whatever it is; its order is declared, and
    shown by `compare`. `check` evaluates the theorems of the discrete theory for it.

    Parameters
    ----------
    function : function
        ``(L, t, q0, q1, z0, h, **parameters)``, which returns L_d(q0, q1, z0) for the step from t to t + h. It is called once,
        with symbols in place of numbers. ``L(t, q, v, z)`` is the Lagrangian of the system.
    order : int
        The order of the flow.
    name : str, optional
        Its name in plans and comparisons; by default that of the function.
    symmetric : bool
        Whether it is equal to its adjoint.

    Returns
    -------
    Method

    Examples
    --------
    The trapezoidal rule:

    >>> import herglotz as hz
    >>> def trapezoidal(L, t, q0, q1, z0, h):
    ...     v = (q1 - q0) / h
    ...     return h * (L(t, q0, v, z0) + L(t + h, q1, v, z0)) / 2
    >>> mine = hz.method(trapezoidal, order=1)
    >>> sol = hz.solve("pendulum", [1.0], [0.0], 10.0, integrator=mine, step=0.01)
    >>> sol.plan.integrator, hz.check("pendulum", [1.0], [0.0], 10.0, integrator=mine, step=0.01).is_contact
    ('trapezoidal', True)
    """
    if not callable(function):
        raise ValueError(f"`function` is {function!r}; it must be a function (L, t, q0, q1, z0, h)")
    if isinstance(order, bool) or not isinstance(order, (int, np.integer)) or order < 1:
        raise ValueError(f"`order` is {order!r}; it must be a whole number from 1, the order of the flow")
    if name is None:
        name = getattr(function, "__name__", "<lambda>")
        name = "own" if name == "<lambda>" else name
    if not isinstance(name, str) or not name:
        raise ValueError(f"`name` is {name!r}; it must be a text")
    return Method(function, int(order), name, bool(symmetric))


def integrator_of(integrator, system):
    """An integrator in the form of the core: its name, or the discrete Lagrangian of a method for this system."""
    return integrator._of(system) if isinstance(integrator, Method) else integrator
