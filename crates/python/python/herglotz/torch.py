"""Motions that PyTorch differentiates: `solve`. It needs the package `torch`."""

from typing import NamedTuple

from ._differentiable import check_shapes, differentiable

try:
    import torch
except ImportError as error:
    raise ImportError("herglotz.torch needs the package `torch`; install it with `pip install torch`") from error

__all__ = ["Rows", "solve"]


class Rows(NamedTuple):
    """The k rows of a motion as tensors of double precision."""

    q: torch.Tensor  # (k, n)
    v: torch.Tensor  # (k, n)
    z: torch.Tensor  # (k,)


class _Motion(torch.autograd.Function):
    @staticmethod
    def forward(ctx, of, q0, v0, z0, values):
        sol = of.run(*(x.detach().cpu().numpy() for x in (q0, v0, z0, values)))
        ctx.motion = of, sol
        return tuple(torch.from_numpy(x.copy()) for x in (sol.q, sol.v, sol.z))

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx, q, v, z):
        of, sol = ctx.motion
        found = of.gradient(sol, *(x.cpu().numpy() for x in (q, v, z)))
        return None, *(torch.as_tensor(x, dtype=torch.float64) for x in found)


def solve(L, q0, v0, t, *, z0=0.0, parameters=None, **options):
    """The rows of a motion, differentiable in the start and in the parameters.

    Gradients are those of `Solution.pullback`: of the discrete motion, by the adjoint of its steps. The motion runs on
    the CPU in double precision. Gradients are not differentiable again.

    Parameters
    ----------
    L, t
        As in `herglotz.solve`. The times are fixed.
    q0, v0 : tensors of shape (n,)
    z0 : float or tensor of shape ()
    parameters : dict of float, optional
        The values of the parameters by name, which may be tensors.
    options
        The other arguments of `herglotz.solve` that determine a motion, such as `accuracy`, `integrator`, `step`,
        `coordinates`, `force` and `events` with resets.

    Returns
    -------
    Rows

    Raises
    ------
    ValueError
        For an invalid argument, and for a motion that is not completed, with its status.
    """
    if "threads" in options:
        raise ValueError("`threads` cannot be given here: a motion is one computation; run several threads of your own")
    parameters = dict(parameters or {})
    check_shapes(parameters, z0)
    of_double = lambda x: torch.as_tensor(x, dtype=torch.float64, device="cpu")
    q0, v0, z0 = of_double(q0), of_double(v0), of_double(z0)
    of = differentiable(L, t, q0.shape[-1] if q0.ndim else 1, parameters, options)
    values = torch.stack([of_double(x) for x in parameters.values()]) if parameters else torch.zeros(0, dtype=torch.float64)
    return Rows(*_Motion.apply(of, q0, v0, z0, values))
