"""Motions as differentiable functions of their start and parameters, for libraries of automatic differentiation."""

import numpy as np

from . import _core
from ._solve import solve
from ._system import check_parameters, system


class DifferentiableMotion:
    """The rows of a motion as a function of q0, v0, z0 and of the values of named parameters."""

    def __init__(self, L, t, n, names, options):
        options = dict(options)
        named = {name: options.pop(name) for name in ("coordinates", "force", "rayleigh", "tables", "breaks") if name in options}
        if refused := {"q0", "v0", "p0", "z0", "events", "observe", "every"} & set(options):
            raise ValueError(f"`{min(refused)}` cannot be given here: a differentiable motion is one from q0, v0 and z0 with rows at `t`")
        # The values are set before each run.
        self.system = system(L, parameters=dict.fromkeys(names, 1.0) or None, n=n, **named)
        check_parameters(self.system, names, (L,), ())
        self.names, self.options = tuple(names), options
        self.t = np.array(t, dtype=float)
        self.rows = 2 if self.t.ndim == 0 else len(self.t)
        self.n = self.system.dimension

    def run(self, q0, v0, z0, values):
        """The solution; a motion that is not completed is an error with its status."""
        values = {name: float(value) for name, value in zip(self.names, values)}
        of: _core.System = self.system.with_parameters(values) if values else self.system
        sol = solve(of, numbers(q0), numbers(v0), self.t, z0=float(z0), **self.options)
        if not sol.success:
            raise ValueError(f"the motion was not completed: {sol.status}")
        return sol

    def gradient(self, sol, q, v, z):
        """The gradient in q0, v0, z0 and the values of the parameters."""
        found = sol.pullback(q=np.asarray(q), v=np.asarray(v), z=np.asarray(z))
        return found.q0, found.v0, found.z0, np.array([found.parameters[name] for name in self.names])


# Motions by their arguments: for a motion that is made anew in each iteration, JAX would compile its callback again.
_KNOWN = {}
_MOST = 128


def differentiable(L, t, n, names, options):
    """The differentiable motion of these arguments; the same object for the same ones."""
    of = DifferentiableMotion(L, t, n, names, options)
    try:
        key = of.system, of.t.shape, of.t.tobytes(), of.names, frozenset(of.options.items())
        if len(_KNOWN) >= _MOST and key not in _KNOWN:
            _KNOWN.clear()
        return _KNOWN.setdefault(key, of)
    except TypeError:
        # An option that cannot be hashed, such as an array of scales.
        return of


def numbers(x):
    return np.array(x, dtype=float)
