"""Derivatives of the members of ensembles."""

from typing import NamedTuple

import numpy as np

from . import _core
from ._arguments import Arguments
from ._ensemble import ensemble, request_of
from ._events import coordinates_with
from ._sensitivity import names_of_variables, partials, refuse_of_rows


class EnsembleSensitivity(NamedTuple):
    """The derivatives of the k rows of M members with respect to a variable, or to m of them; see `Ensemble.sensitivity`.

    A member without derivatives has NaN, and the reason in `troubles`, by its index; there are also the warnings of others, as
    in `Ensemble.troubles`.
    """

    q: np.ndarray  # (M, k, n) or (M, k, n, m)
    v: np.ndarray  # (M, k, n) or (M, k, n, m)
    p: np.ndarray  # (M, k, n) or (M, k, n, m)
    z: np.ndarray  # (M, k) or (M, k, m)
    growth: np.ndarray  # (M,)
    troubles: dict


class EnsembleGradient(NamedTuple):
    """The gradients of a number of each of M members with respect to its variables; see `Ensemble.pullback`.

    As `Gradient`, with a row for each member; that of the sum in a parameter with the same value for all members is the
    sum of its column. A member without a gradient has NaN, and the reason in `troubles`, by its index; there are also the
    warnings of others, as in `Ensemble.troubles`.
    """

    q0: np.ndarray  # (M, n)
    v0: np.ndarray | None  # (M, n)
    p0: np.ndarray | None  # (M, n)
    z0: np.ndarray  # (M,)
    parameters: dict  # arrays (M,) by name
    t0: np.ndarray  # (M,)
    t_end: np.ndarray  # (M,)
    growth: np.ndarray  # (M,)
    troubles: dict


def sensitivity(many, variables):
    """See `Ensemble.sensitivity`."""
    names, is_one = names_of_variables(variables)
    found = sensitivity_of(many.system, many._request, names)
    if is_one:
        q, v, p, z = (x[..., 0] for x in found[:4])
        found = found._replace(q=q, v=v, p=p, z=z)
    return found


def pullback(many, q=None, v=None, p=None, z=None):
    """See `Ensemble.pullback`."""
    return pullback_of(many.system, many._request, q, v, p, z)


def sensitivity_of(system, request, names):
    """The derivatives of the rows of the members of a request with respect to variables."""
    (q, v, p), z, growth, troubles = _core.ensemble_sensitivity(system, request, names)
    shape = *_shape(request), len(names)
    n = len(coordinates_with(system, request[6]))
    q, v, p = (x.reshape(*shape, n).transpose(0, 1, 3, 2) for x in (q, v, p))
    return EnsembleSensitivity(q, v, p, z.reshape(shape), growth, dict(troubles))


def pullback_of(system, request, q=None, v=None, p=None, z=None):
    """The gradients of numbers with these partial derivatives in the rows of the members of a request."""
    shape = _shape(request)
    n = len(coordinates_with(system, request[6]))
    parts = [partials(name, x, (*shape, n), 1) for name, x in (("q", q), ("v", v), ("p", p))]
    return _gradient(system, request, _core.ensemble_pullback(system, request, parts, partials("z", z, shape, 1)))


def _shape(request):
    """The number of members, and that of rows: a single number is the final time of motions from 0."""
    (q0, *_), t = request[:2]
    return len(q0), np.size(t) if np.ndim(t) else 2


def ensemble_value_and_grad(loss):
    """A function that runs an ensemble, and returns the values of a loss of the final states with the gradients.

    The members are run on several threads, each as by `value_and_grad`; the result does not depend on the number of
    threads. The gradient of the sum of all values in a shared parameter is the sum of its column.

    Parameters
    ----------
    loss : str or function
        As in `value_and_grad`. It has the parameters of the member.

    Returns
    -------
    function
        It takes the arguments of `ensemble`, except `observe`, and returns the values, of shape (M,), and an `EnsembleGradient`. A member
        that was not completed has NaN, and its status in `troubles`.

    Raises
    ------
    ValueError
        By the function: for an invalid argument.

    Examples
    --------
    >>> import numpy as np, herglotz as hz
    >>> square = hz.ensemble_value_and_grad("theta^2")
    >>> values, gradient = square("pendulum", np.linspace(0.1, 1, 10)[:, None], np.zeros((10, 1)), 10.0, accuracy=1e-8)
    >>> values.shape, gradient.q0.shape, gradient.parameters["gamma"].shape
    ((10,), (10, 1), (10,))
    """

    def run(*arguments, **named):
        given = _ENSEMBLE.bind(arguments, named)
        refuse_of_rows(given, "a loss is a number of the final state, and has no rows", "observe")
        refuse_of_rows(given, "values and their gradients are computed in one call", "progress")
        given.pop("progress")
        # As a column it is traced, and its parameters and tables are found.
        of, request, columns = request_of(**given | {"observe": {"loss": loss}})
        values, *gradients = _core.ensemble_value_and_gradient(of, request, columns[0])
        return values, _gradient(of, request, (values, *gradients))

    return run


_ENSEMBLE = Arguments(ensemble)


def _gradient(system, request, found):
    _, q0, velocity, z0, parameters, (t0, t_end, growth), troubles = found
    v0, p0 = (None, velocity) if request[0][2] else (velocity, None)
    by_name = dict(zip(system.parameters, parameters.T.copy()))
    return EnsembleGradient(q0, v0, p0, z0, by_name, t0, t_end, growth, dict(troubles))
