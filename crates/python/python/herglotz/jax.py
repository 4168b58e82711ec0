"""Motions that JAX differentiates: `solve`. It needs the package `jax`."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ._differentiable import differentiable

try:
    import jax
    import jax.numpy as jnp
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

    Gradients are those of `Solution.pullback`: of the discrete motion, by the adjoint of its steps, in reverse mode
    (`jax.grad`, `jax.vjp`, `jax.jacrev`). The motion runs on the CPU by a callback, also under `jax.jit`; `jax.vmap` runs
    one motion after the other. Numbers have the precision of JAX: set ``jax.config.update("jax_enable_x64", True)`` for
    double precision, without which start, rows and gradients are rounded to single precision.

    Parameters
    ----------
    L, t
        As in `herglotz.solve`. The times are fixed.
    q0, v0 : arrays of shape (n,)
    z0 : float or array of shape ()
    parameters : dict of float, optional
        The values of the parameters by name, which may be traced by JAX.
    options
        The other arguments of `herglotz.solve`, such as `accuracy`, `integrator`, `step`, `coordinates` and `force`.

    Returns
    -------
    Rows

    Raises
    ------
    ValueError
        For an invalid argument. Where the motion is run by JAX, an exception of JAX with the same message.
    """
    parameters = dict(parameters or {})
    q0, v0, z0 = jnp.asarray(q0, dtype=float), jnp.asarray(v0, dtype=float), jnp.asarray(z0, dtype=float)
    of = differentiable(L, t, q0.shape[-1] if q0.ndim else 1, parameters, options)
    if q0.shape != (of.n,) or v0.shape != (of.n,):
        raise ValueError(f"`q0` and `v0` have the shapes {q0.shape} and {v0.shape}; they must be ({of.n},)")
    values = jnp.stack([jnp.asarray(x, dtype=float) for x in parameters.values()]) if parameters else jnp.zeros(0)
    return Rows(*_motion(of, q0.dtype)(q0, v0, z0, values))


@lru_cache(maxsize=128)
def _motion(of, kind):
    """The rows as a function of q0, v0, z0 and the values of the parameters."""
    shaped = lambda *shape: jax.ShapeDtypeStruct(shape, kind)
    rows = shaped(of.rows, of.n), shaped(of.rows, of.n), shaped(of.rows)
    slopes = shaped(of.n), shaped(of.n), shaped(), shaped(len(of.names))
    of_kind = lambda arrays: tuple(np.asarray(x, dtype=kind) for x in arrays)

    def run(*start):
        sol = of.run(*start)
        return of_kind((sol.q, sol.v, sol.z))

    def pull(start, rows):
        return of_kind(of.gradient(of.run(*start), *(np.array(x, dtype=float) for x in rows)))

    @jax.custom_vjp
    def motion(*start):
        return jax.pure_callback(run, rows, *start, vmap_method="sequential")

    def forward(*start):
        return motion(*start), start

    def backward(start, of_rows):
        return jax.pure_callback(pull, slopes, start, of_rows, vmap_method="sequential")

    motion.defvjp(forward, backward)
    return motion
