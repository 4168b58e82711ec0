"""Motions as differentiable functions of their start and parameters, for libraries of automatic differentiation."""

import warnings

import numpy as np

from . import _core
from ._arguments import Arguments
from ._ensemble import ensemble, request_of
from ._ensemble_derivatives import pullback_of, sensitivity_of
from ._events import events_of, texts_of_events
from ._sensitivity import refuse_of_rows
from ._solve import functions_of, solve
from ._system import check_used, system_of, with_tables

_ENSEMBLE = Arguments(ensemble)
# The arguments of `solve` that belong to the system.
_OF_SYSTEM = "coordinates", "force", "rayleigh", "tables", "breaks", "action", "constraints"


class DifferentiableMotion:
    """The rows of a motion as a function of q0, v0, z0 and of the values of named parameters."""

    def __init__(self, L, t, n, names, options):
        if refused := {"q0", "v0", "p0", "z0", "H", "momenta", "friction"} & set(options):
            raise ValueError(
                f"`{min(refused)}` cannot be given here: a differentiable motion is one of a Lagrangian from q0, v0 and z0 "
                "with rows at `t`"
            )
        refused = "observe", "every", "conformal_factor", "estimate", "exact", "progress", "callback"
        refuse_of_rows(options, "the rows have q, v and z at the times `t`", *refused)
        options = {name: value for name, value in options.items() if value is not None}
        self.threads = options.pop("threads", None)
        named = {name: options.pop(name) for name in _OF_SYSTEM if name in options}
        # The values are set before each run.
        of = system_of(L, parameters=dict.fromkeys(names, 1.0) or None, n=n, **named)
        found = {}
        events = events_of(options.get("events", ()), of, found)
        self.system = with_tables(of, found)
        functions = L, *functions_of(named.get("force"), named.get("rayleigh"))
        check_used(self.system, names, named.get("tables"), functions, list(texts_of_events(events)))
        self.names, self.options = tuple(names), options
        # An ensemble has not all arguments of a single motion: with others its members are run by themselves.
        self.is_alone = not set(options) <= set(_ENSEMBLE.names)
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
        if sol.unresolved is not None:
            warnings.warn(f"the motion is not resolved: {sol.unresolved}", stacklevel=2)
        return sol

    def gradient(self, sol, q, v, z):
        """The gradient in q0, v0, z0 and the values of the parameters."""
        found = sol.pullback(q=np.asarray(q), v=np.asarray(v), z=np.asarray(z))
        return found.q0, found.v0, found.z0, np.array([found.parameters[name] for name in self.names])

    def batch_of_rows(self, *start):
        """q, v and z of the rows of motions from arrays with axes of a batch in front, along which they are broadcast."""
        batch, members = self._members(start)
        if batch is None:
            found = [self._rows_of(*(x[i] for x in members)) for i in range(len(members[0]))]
            q, v, z = (np.stack(x) for x in zip(*found))
        else:
            q, v, z = self._rows_of_ensemble(members)
        shape = np.broadcast_shapes(*self._batches(start))
        return tuple(x.reshape((*shape, *x.shape[1:])) for x in (q, v, z))

    def batch_of_tangents(self, *start_and_tangents):
        """The derivatives of these rows along tangents of the start."""
        start, tangents = start_and_tangents[:4], start_and_tangents[4:]
        tangent = self._tangent(tangents)
        # A variable costs a column of the tangent of the steps.
        moved = np.flatnonzero(np.any(tangent.reshape(-1, tangent.shape[-1]) != 0.0, axis=0))
        shape = np.broadcast_shapes(*self._batches(start), tangent.shape[:-1])
        if not len(moved):
            return tuple(np.zeros((*shape, *x)) for x in ((self.rows, self.n), (self.rows, self.n), (self.rows,)))
        variables = [*(f"q[{i}]" for i in range(self.n)), *(f"v[{i}]" for i in range(self.n)), "z", *self.names]
        variables = [variables[i] for i in moved]
        alone, members = self._members(start)
        if alone is None:
            found = [self.run(*(x[i] for x in members)).sensitivity(variables) for i in range(len(members[0]))]
            q, v, z = (np.stack([getattr(x, name) for x in found]) for name in "qvz")
        else:
            found = _completed(sensitivity_of(*self._request(members), variables))
            q, v, z = found.q, found.v, found.z
        of = np.broadcast_shapes(*self._batches(start))
        q, v, z = (x.reshape((*of, *x.shape[1:])) for x in (q, v, z))
        q, v = (np.einsum("...kiv,...v->...ki", x, tangent[..., moved]) for x in (q, v))
        return q, v, np.einsum("...kv,...v->...k", z, tangent[..., moved])

    def batch_of_gradients(self, *start_and_covectors):
        """The gradients in the start of numbers with these partial derivatives in the rows."""
        start, covectors = start_and_covectors[:4], start_and_covectors[4:]
        batches = [*self._batches(start), *(x.shape[: x.ndim - axes] for x, axes in zip(covectors, (2, 2, 1)))]
        shape = np.broadcast_shapes(*batches)
        wide = lambda x, own: np.broadcast_to(x, (*shape, *own)).reshape((int(np.prod(shape)), *own))
        q, v, z = (wide(numbers(x), own) for x, own in zip(covectors, ((self.rows, self.n),) * 2 + ((self.rows,),)))
        alone, members = self._members(start, shape)
        if alone is None:
            found = []
            for i in range(len(q)):
                found.append(self.gradient(self.run(*(x[i] for x in members)), q[i], v[i], z[i]))
            found = [np.stack(x) for x in zip(*found)]
        else:
            of = _completed(pullback_of(*self._request(members), q=q, v=v, z=z))
            values = [of.parameters[name] for name in self.names]
            found = of.q0, of.v0, of.z0, np.stack(values, axis=-1) if values else np.zeros((len(q), 0))
        return tuple(x.reshape((*shape, *x.shape[1:])) for x in found)

    def _batches(self, start):
        return [x.shape[: x.ndim - axes] for x, axes in zip(start, (1, 1, 0, 1))]

    def _tangent(self, parts):
        """The tangents of q0, v0, z0 and the values as one vector for each member."""
        parts = [numbers(x) if i != 2 else numbers(x)[..., None] for i, x in enumerate(parts)]
        batch = np.broadcast_shapes(*(x.shape[:-1] for x in parts))
        return np.concatenate([np.broadcast_to(x, (*batch, x.shape[-1])) for x in parts], axis=-1)

    def _members(self, start, batch=None):
        """The starts of the members of a batch, and its shape if they are run as an ensemble."""
        batch = np.broadcast_shapes(*self._batches(start)) if batch is None else batch
        own = (self.n,), (self.n,), (), (len(self.names),)
        count = int(np.prod(batch))
        members = [np.broadcast_to(numbers(x), (*batch, *shape)).reshape((count, *shape)) for x, shape in zip(start, own)]
        return (None if len(members[0]) == 1 or self.is_alone else batch), members

    def _rows_of(self, *start):
        sol = self.run(*start)
        return sol.q, sol.v, sol.z

    def _arguments(self, members, t):
        """The arguments of `ensemble`."""
        q0, v0, z0, values = members
        parameters = {name: values[:, i].copy() for i, name in enumerate(self.names)} or None
        return (self.system, q0, v0, t), dict(z0=z0, parameters=parameters, threads=self.threads, **self.options)

    def _request(self, members):
        given, named = self._arguments(members, self.t)
        arguments = _ENSEMBLE.bind(given, named)
        arguments.pop("progress")
        return request_of(**arguments)[:2]

    def _ensemble(self, members, t):
        given, named = self._arguments(members, t)
        many = ensemble(*given, **named)
        if not many.success.all():
            index = int(np.argmin(many.success))
            raise ValueError(f"motion {index} of the batch was not completed: {many.troubles[index]}")
        _warn(many.troubles)
        return many

    def _rows_of_ensemble(self, members):
        t = np.array([0.0, self.t]) if self.t.ndim == 0 else self.t
        if len(t) > 2:
            many = self._ensemble(members, self.t)
            return many.q, many.v, many.z
        # With a row between, each member is run by itself, with steps that are chosen for it, as for its derivatives.
        many = self._ensemble(members, np.array([t[0], 0.5 * (t[0] + t[1]), t[1]]))
        return many.q[:, ::2], many.v[:, ::2], many.z[:, ::2]


def _completed(found):
    for index, trouble in found.troubles.items():
        if np.isnan(found.growth[index]):
            raise ValueError(f"motion {index} of the batch has no derivatives: {trouble}")
    _warn(found.troubles)
    return found


def _warn(troubles):
    for index, trouble in troubles.items():
        warnings.warn(f"motion {index} of the batch is not resolved: {trouble}", stacklevel=2)


def check_shapes(parameters, z0):
    """Refuses parameters and an action that are no single numbers."""
    for name, x in (*((f"parameters[{name!r}]", x) for name, x in parameters.items()), ("z0", z0)):
        # Traced values and tensors have a shape of their own.
        shape = tuple(x.shape) if hasattr(x, "shape") else np.shape(x)
        if shape:
            raise ValueError(f"`{name}` has the shape {shape}; it must be a single number, of shape (): take an entry of it, such as x[0]")


# Motions by their arguments: for a motion that is made anew in each iteration, JAX would compile its callback again.
_KNOWN = {}
_MOST = 128


def differentiable(L, t, n, names, options):
    """The differentiable motion of these arguments; the same object for the same ones."""
    of = DifferentiableMotion(L, t, n, names, options)
    try:
        key = of.system, of.t.shape, of.t.tobytes(), of.names, of.threads, frozenset(of.options.items())
        if len(_KNOWN) >= _MOST and key not in _KNOWN:
            _KNOWN.clear()
        return _KNOWN.setdefault(key, of)
    except TypeError:
        # An option that cannot be hashed, such as an array of scales.
        return of


def numbers(x):
    return np.array(x, dtype=float)
