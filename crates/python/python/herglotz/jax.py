"""Motions that JAX differentiates: `solve`. It needs the package `jax`."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ._differentiable import check_shapes, differentiable

try:
    import jax
    import jax.numpy as jnp
    from jax.extend.core import Primitive
    from jax.interpreters import ad, batching, mlir
except ImportError as error:
    raise ImportError("herglotz.jax needs the package `jax`; install it with `pip install jax`") from error

__all__ = ["Rows", "solve"]


class Rows(NamedTuple):
    """The k rows of a motion as arrays of JAX."""

    q: jax.Array  # (k, n)
    v: jax.Array  # (k, n)
    z: jax.Array  # (k,)


def solve(L, q0, v0, t, *, z0=0.0, parameters=None, **options):
    """The rows of a motion, differentiable in the start and in the parameters.

    Derivatives are those of the discrete motion: in reverse mode (`jax.grad`, `jax.vjp`, `jax.jacrev`) by the adjoint of
    its steps, as `Solution.pullback` has them, and in forward mode (`jax.jvp`, `jax.jacfwd`) by their tangents, as
    `Solution.sensitivity`. They are not differentiable again. The motion runs on the CPU by a callback, also under
    `jax.jit`; under `jax.vmap` the motions are run on several threads, as those of `ensemble`, with the argument `threads`
    of it. Numbers have the precision of JAX: set ``jax.config.update("jax_enable_x64", True)`` for double precision,
    without which start, rows and derivatives are rounded to single precision.

    Parameters
    ----------
    L, t
        As in `herglotz.solve`. The times are fixed.
    q0, v0 : arrays of shape (n,)
    z0 : float or array of shape ()
    parameters : dict of float, optional
        The values of the parameters by name, which may be traced by JAX.
    options
        The other arguments of `herglotz.solve` that determine a motion, such as `accuracy`, `integrator`, `step`,
        `coordinates`, `force` and `events` with resets; and `threads`.

    Returns
    -------
    Rows

    Raises
    ------
    ValueError
        For an invalid argument. Where the motion is run by JAX, an exception of JAX with the same message.
    """
    parameters = dict(parameters or {})
    check_shapes(parameters, z0)
    q0, v0, z0 = jnp.asarray(q0, dtype=float), jnp.asarray(v0, dtype=float), jnp.asarray(z0, dtype=float)
    of = differentiable(L, t, q0.shape[-1] if q0.ndim else 1, parameters, options)
    if q0.shape != (of.n,) or v0.shape != (of.n,):
        raise ValueError(f"`q0` and `v0` have the shapes {q0.shape} and {v0.shape}; they must be ({of.n},)")
    values = jnp.stack([jnp.asarray(x, dtype=float) for x in parameters.values()]) if parameters else jnp.zeros(0)
    return Rows(*_motion(of)(q0, v0, z0, values))


# The numbers of axes of q0, v0, z0 and the values, and of the rows. Axes before these are those of batches.
_OF_START = 1, 1, 0, 1
_OF_ROWS = 2, 2, 1


@lru_cache(maxsize=128)
def _motion(of):
    """The rows as a function of q0, v0, z0 and the values of the parameters.

    It consists of three primitives: the rows, their derivative along a tangent of the start, and its transpose. The second
    is linear in the tangent, so that JAX derives both modes; `custom_jvp` and `custom_vjp` exclude each other.
    """
    of_start, of_rows = ((of.n,), (of.n,), (), (len(of.names),)), ((of.rows, of.n), (of.rows, of.n), (of.rows,))
    rows = _primitive("herglotz_rows", of.batch_of_rows, _OF_START, of_rows)
    along = _primitive("herglotz_tangent", of.batch_of_tangents, 2 * _OF_START, of_rows)
    back = _primitive("herglotz_adjoint", of.batch_of_gradients, _OF_START + _OF_ROWS, of_start)

    def forward(start, tangents):
        tangents = map(ad.instantiate_zeros, tangents)
        return rows.bind(*start), along.bind(*start, *tangents)

    def transposed(covectors, *start_and_tangents):
        start = start_and_tangents[:4]
        found = back.bind(*start, *map(ad.instantiate_zeros, covectors))
        batch = np.broadcast_shapes(*(x.shape[: x.ndim - axes] for x, axes in zip(found, _OF_START)))
        # A tangent with fewer members than the start is broadcast, whose transpose is the sum.
        sums = [
            _summed(x, of.aval.shape, len(batch)) if ad.is_undefined_primal(of) else None
            for x, of in zip(found, start_and_tangents[4:])
        ]
        return [None] * 4 + sums

    ad.primitive_jvps[rows] = forward
    ad.primitive_transposes[along] = transposed
    for linear in (along, back):
        ad.primitive_jvps[linear] = lambda given, tangents, linear=linear: _of_linear(linear, given, tangents)
    return rows.bind


def _of_linear(linear, given, tangents):
    """The derivative of a function of a start that is linear in its other arguments."""
    if not all(isinstance(x, ad.Zero) for x in tangents[:4]):
        raise NotImplementedError(
            "second derivatives of motions are not implemented; use the differences of first derivatives"
        )
    return linear.bind(*given), linear.bind(*given[:4], *map(ad.instantiate_zeros, tangents[4:]))


def _summed(x, shape, batch):
    """The sum over the axes of a batch that have the length 1 in a shape."""
    axes = tuple(i for i in range(batch) if shape[i] == 1 and x.shape[i] != 1)
    return jnp.sum(x, axis=axes, keepdims=True) if axes else x


def _primitive(name, of_batch, axes, shapes):
    """A primitive that calls a function of arrays with any number of axes in front, along which it is broadcast."""
    primitive = Primitive(name)
    primitive.multiple_results = True

    def batch_of(args):
        return np.broadcast_shapes(*(x.shape[: x.ndim - own] for x, own in zip(args, axes)))

    def results(args):
        batch, kind = batch_of(args), args[0].dtype
        return [jax.ShapeDtypeStruct((*batch, *shape), kind) for shape in shapes]

    def called(*args):
        expected = results(args)
        run = lambda *args: [np.asarray(x, dtype=e.dtype) for x, e in zip(of_batch(*args), expected)]
        # Batches are this primitive's own.
        return jax.pure_callback(run, expected, *args)

    def batched(args, dims):
        # All have the same number of axes in front: a new one, of the length 1 where an argument is not mapped.
        moved = [jnp.expand_dims(x, 0) if dim is None else jnp.moveaxis(x, dim, 0) for x, dim in zip(args, dims)]
        return primitive.bind(*moved), [0] * len(shapes)

    def abstract(*args):
        return [jax.core.ShapedArray(x.shape, x.dtype) for x in results(args)]

    primitive.def_impl(called)
    primitive.def_abstract_eval(abstract)
    batching.primitive_batchers[primitive] = batched
    mlir.register_lowering(primitive, mlir.lower_fun(called, multiple_results=True))
    return primitive
