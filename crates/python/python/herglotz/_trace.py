"""Tracing: functions of the user are called once, with symbols in place of numbers.

`Traced` is an array of symbols. It is a subclass of `numpy.ndarray`, so that slices, sums, products, stacking and the
like are those of NumPy; ufuncs, and the few other functions that depend on values, are replaced here.
"""

import inspect

import numpy as np

from ._core import Condition, Symbol, symbols, velocity_names


class Traced(np.ndarray):
    """An array of symbols and numbers."""

    def __array_ufunc__(self, ufunc, method, *inputs, **kwargs):
        if ufunc is np.matmul and not kwargs and type(inputs[0]) is type(inputs[1]) is Traced:
            # The most frequent operation has a shortcut.
            found = ufunc(inputs[0].view(np.ndarray), inputs[1].view(np.ndarray))
            return found.view(Traced) if isinstance(found, np.ndarray) else found
        return apply(ufunc, method, inputs, kwargs)

    def __array_function__(self, func, types, args, kwargs):
        return call(func, args, kwargs)


def array(values):
    """An array of traced values and numbers: like `np.array`, which hides the trace from some NumPy functions.

    Parameters
    ----------
    values : nested sequences of traced values and numbers
    """
    found = np.array(values, dtype=object)
    return found.view(Traced)


def _unary(name):
    known = getattr(np, name)

    def function(x):
        return x.apply(name) if isinstance(x, Symbol) else known(float(x))

    return np.frompyfunc(function, 1, 1)


def _binary(name):
    known = getattr(np, name)

    def function(x, y):
        if isinstance(x, Symbol):
            return x.apply_two(name, y)
        if isinstance(y, Symbol):
            return y.apply_two(name, x, True)
        return known(float(x), float(y))

    return np.frompyfunc(function, 2, 1)


def _choose(condition, x, y):
    if isinstance(condition, Condition):
        if not isinstance(x, Symbol) and not isinstance(y, Symbol) and x is y:
            return x
        return condition.choose(x, y)
    return x if condition else y


_UNARY = (
    "negative positive reciprocal sqrt absolute fabs sign sin cos tan arctan arcsin arccos sinh cosh tanh arcsinh arccosh "
    "arctanh exp expm1 log log1p log2 log10 square conjugate"
)
_UFUNCS = {getattr(np, name): _unary(name) for name in _UNARY.split()}
_BINARY = {"minimum": "minimum", "maximum": "maximum", "fmin": "minimum", "fmax": "maximum"}
_BINARY |= {"arctan2": "arctan2", "hypot": "hypot"}
_UFUNCS |= {getattr(np, name): _binary(known) for name, known in _BINARY.items()}
_OPERATORS = {
    np.less: lambda x, y: x < y,
    np.less_equal: lambda x, y: x <= y,
    np.greater: lambda x, y: x > y,
    np.greater_equal: lambda x, y: x >= y,
    np.equal: lambda x, y: x == y,
    np.not_equal: lambda x, y: x != y,
    np.logical_and: lambda x, y: x & y,
    np.logical_or: lambda x, y: x | y,
    np.bitwise_and: lambda x, y: x & y,
    np.bitwise_or: lambda x, y: x | y,
    np.power: lambda x, y: x**y,
    np.float_power: lambda x, y: x**y,
}
_UFUNCS |= {ufunc: np.frompyfunc(function, 2, 1) for ufunc, function in _OPERATORS.items()}
_NOT = np.frompyfunc(lambda x: ~x if isinstance(x, Condition) else not x, 1, 1)
_UFUNCS |= {np.logical_not: _NOT, np.invert: _NOT}
_JUMPING = "floor_divide remainder fmod divmod modf floor ceil rint trunc isnan isinf isfinite heaviside".split()
# Their implementation for object arrays is the right one.
_OWN = {np.add, np.subtract, np.multiply, np.divide, np.matmul}
_OWN |= {getattr(np, name) for name in ("vecdot", "matvec", "vecmat") if hasattr(np, name)}


def _plain(x):
    """The value as a plain array of objects."""
    if isinstance(x, (Symbol, Condition)):
        found = np.empty((), dtype=object)
        found[()] = x
        return found
    if isinstance(x, np.ndarray):
        return x.view(np.ndarray).astype(object, copy=False)
    return x


def _wrapped(found):
    if isinstance(found, np.ndarray):
        return found.view(Traced) if found.ndim else found[()]
    return found


def apply(ufunc, method, inputs, kwargs):
    """A NumPy ufunc, applied to arrays with symbols."""
    kwargs = dict(kwargs or {})
    out = kwargs.pop("out", None)
    known = _UFUNCS.get(ufunc) or (ufunc if ufunc in _OWN else None)
    if known is None:
        hint = "it is discontinuous: write its pieces with hz.where" if ufunc.__name__ in _JUMPING else "write it out"
        raise TypeError(f"np.{ufunc.__name__} is not supported for traced values: {hint}")
    found = getattr(known, method)(*map(_plain, inputs), **kwargs)
    if out is not None:
        out[0][...] = found
        return out[0]
    return _wrapped(found)


def _where(condition, x, y):
    """Like `np.where`: x where a condition on traced values holds, else y."""
    return _wrapped(_CHOOSE(_plain(condition), _plain(x), _plain(y)))


_CHOOSE = np.frompyfunc(_choose, 3, 1)


def where(condition, x, y):
    """x where a condition holds, else y, elementwise: `np.where`, for traced values and for numbers."""
    return np.where(condition, x, y)


def _norm(x, ord=None, axis=None, keepdims=False):
    x = np.asanyarray(x)
    if x.ndim > 1 and axis is None and ord is not None:
        raise TypeError("np.linalg.norm of a traced matrix supports only ord=None")
    if ord in (None, 2):
        return np.sqrt(np.sum(x * x, axis=axis, keepdims=keepdims))
    if ord == 1:
        return np.sum(np.abs(x), axis=axis, keepdims=keepdims)
    if ord == np.inf:
        return np.max(np.abs(x), axis=axis, keepdims=keepdims)
    raise TypeError(f"np.linalg.norm with ord={ord} is not supported for traced values: use None, 1, 2 or inf")


def _select(condlist, choicelist, default=0):
    found = default
    for condition, choice in reversed(list(zip(condlist, choicelist))):
        found = _where(condition, choice, found)
    return found


def _clip(a, a_min=None, a_max=None, **kwargs):
    low, high = kwargs.get("min", a_min), kwargs.get("max", a_max)
    a = a if low is None else np.maximum(a, low)
    return a if high is None else np.minimum(a, high)


def _interp(x, xp, fp, left=None, right=None, period=None):
    if period is not None:
        raise TypeError("np.interp with a period is not supported for traced values: write its pieces with hz.where")
    try:
        xp, fp = np.asarray(xp, float), np.asarray(fp, float)
    except TypeError:
        raise TypeError("np.interp does not support traced knots: write its pieces with hz.where") from None
    if xp.ndim != 1 or xp.shape != fp.shape or len(xp) == 0 or not np.all(np.diff(xp) > 0):
        raise ValueError("np.interp of a traced value requires increasing knots, and one value for each knot")
    x = x if isinstance(x, Symbol) else array(x)
    found = fp[-1] if right is None else _where(x > xp[-1], right, fp[-1])
    for k in reversed(range(len(xp) - 1)):
        slope = (fp[k + 1] - fp[k]) / (xp[k + 1] - xp[k])
        found = _where(x < xp[k + 1], fp[k] + slope * (x - xp[k]), found)
    return _where(x < xp[0], fp[0] if left is None else left, found)


def _polyval(p, x):
    found = 0.0
    for coefficient in p:
        found = found * x + coefficient
    return found


_FUNCTIONS = {np.where: _where, np.linalg.norm: _norm, np.select: _select, np.clip: _clip}
_FUNCTIONS |= {np.interp: _interp, np.polyval: _polyval}


def call(func, args, kwargs):
    """A NumPy function that is not a ufunc, applied to arrays with symbols."""
    own = _FUNCTIONS.get(func)
    if own is not None:
        return own(*args, **kwargs)

    def traced(x):
        if isinstance(x, (Symbol, Condition)):
            return _plain(x).view(Traced)
        if isinstance(x, (list, tuple)):
            return type(x)(map(traced, x))
        return x

    args = [traced(x) for x in args]
    # NumPy's own implementation, which calls ufuncs.
    implementation = getattr(func, "_implementation", func)
    try:
        return _wrapped(implementation(*args, **kwargs))
    except TypeError as error:
        if "traced" in str(error):
            raise
        module = func.__module__.removeprefix("numpy").lstrip(".")
        name = f"np.{module}.{func.__name__}" if module else f"np.{func.__name__}"
        raise TypeError(
            f"{name} is not supported for traced values: write it out with sums, products and functions such as np.sin"
        ) from error


def _vector(values):
    found = Traced(len(values), object)
    for i, value in enumerate(values):
        found[i] = value
    return found


def tabulated(table, t):
    """The values of a table at an array of numbers or of traced values."""
    t = np.asanyarray(t)
    if t.dtype == object:
        return _wrapped(np.frompyfunc(table, 1, 1)(t.view(np.ndarray)))
    if t.dtype.kind not in "fiu":
        raise ValueError(f"a table is evaluated at {t!r}: give a number, an array of numbers or a traced value")
    return _wrapped_numbers(table.values_at(np.ravel(t).astype(float)).reshape(t.shape))


def _wrapped_numbers(found):
    return found if found.ndim else float(found)


def formula_of(function, names, tables):
    """The formula of a function (t, q, v, z, **parameters), in the names of coordinates, velocities and parameters.

    The tables in it are added to the dict `tables`, by the names that they have in the formula.
    """
    return value_text(call_traced(function, names), function, names, tables)


def call_traced(function, names):
    """The value of a function (t, q, v, z, **parameters) of symbols."""
    coordinates, _, parameters = names[:3]
    t, q, v, z, values = symbols(len(coordinates), len(parameters))
    return _called(function, t, _vector(q), _vector(v), z, **_given(function, parameters, values, 4))


# Packages whose functions take numbers of their own in place of symbols.
_FOREIGN = {"jax": "jnp.cos", "torch": "torch.cos", "tensorflow": "tf.cos", "autograd": "autograd.numpy.cos", "cupy": "cupy.cos"}


def _called(function, *given, **named):
    """The value of a function of symbols; an error says where a function of a package that cannot take them is called."""
    try:
        return function(*given, **named)
    except Exception as error:
        package = _foreign_package(error)
        if package is None:
            raise
        raise TypeError(
            f"{name_of(function)} calls a function of {package}, which takes arrays of its own, but it is called once with "
            f"symbols in place of numbers: write np.cos for {_FOREIGN[package]}, and so on; the formula is differentiated exactly"
        ) from error


def _foreign_package(error):
    """The package in which an error was raised, if it is one of these."""
    at, said = error.__traceback__, str(error)
    while at is not None:
        package = at.tb_frame.f_globals.get("__name__", "").partition(".")[0]
        if package in _FOREIGN:
            return package
        at = at.tb_next
    # JAX removes its frames from tracebacks, but names the type and its own functions.
    is_ours = "herglotz.Symbol" in said or "herglotz._trace.Traced" in said
    return next((package for package in _FOREIGN if is_ours and package in said), None)


def call_of_positions(function, names):
    """The value of a function (q, **parameters) of symbols."""
    coordinates, _, parameters = names[:3]
    _, q, _, _, values = symbols(len(coordinates), len(parameters))
    return _called(function, _vector(q), **_given(function, parameters, values, 1))


def _given(function, parameters, values, first):
    """The parameters that a function takes after its `first` arguments, with their symbols."""
    wanted = _parameters_of(function, first)
    if wanted is None:
        return dict(zip(parameters, values))
    required, others = wanted
    for name in required:
        if name not in parameters:
            raise ValueError(
                f"the parameter {name!r} of {name_of(function)} has no value: give parameters={{{name!r}: ...}}"
            )
    return {name: value for name, value in zip(parameters, values) if name in required or name in others}


def texts_of(values, n, what, function, names, tables):
    """The formulas of n numbers that a function returns: an array of them, or a number if n is 1."""
    found = np.array(values, dtype=object)
    if found.ndim > 1 or found.size != n or (found.ndim == 0 and n != 1):
        shape = f"an array of shape {found.shape}" if found.ndim else repr(values)
        raise ValueError(
            f"{name_of(function)} returns {shape} as {what}, but there are {n} coordinates: return an array of shape ({n},)"
        )
    return [value_text(value, function, names, tables) for value in np.ravel(found)]


def components_of(function, n, tables):
    """The formulas of the components of a map (q, p, z) -> (q, p, z), with v in place of p."""
    names = velocity_names([f"q[{n}]"])
    _, q, p, z, _ = symbols(n, 0)
    found = _called(function, _vector(q), _vector(p), z)
    if not isinstance(found, (tuple, list)) or len(found) != 3:
        raise ValueError(f"{name_of(function)} returns {found!r}; it must return a tuple (q, p, z)")
    found = list(np.ravel(np.array(found[0], dtype=object))), list(np.ravel(np.array(found[1], dtype=object))), found[2]
    for what, x in (("q", found[0]), ("p", found[1])):
        if len(x) != n:
            raise ValueError(f"{name_of(function)} returns a {what} with {len(x)} numbers, but there are {n} coordinates")
    return [value_text(x, function, (*names, []), tables) for x in (*found[0], *found[1], found[2])]


def name_of(function):
    return getattr(function, "__name__", "the function")


def _parameters_of(function, first=4):
    """The names of the parameters of a function after its first arguments: without a default, and with one."""
    code = getattr(function, "__code__", None)
    if code is not None and code.co_argcount == first and not code.co_kwonlyargcount and not code.co_flags & 8:
        return (), ()
    try:
        found = list(inspect.signature(function).parameters.values())
    except (TypeError, ValueError):
        return None
    if any(p.kind is p.VAR_KEYWORD for p in found):
        return None
    found = [p for p in found[first:] if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    return [p.name for p in found if p.default is p.empty], [p.name for p in found if p.default is not p.empty]


def value_text(value, function, names, tables):
    """The formula of a traced value, whose tables are added to `tables`."""
    if isinstance(value, np.ndarray):
        if value.ndim:
            raise ValueError(
                f"{name_of(function)} returns an array of shape {value.shape}; it must return a number: take a component, or a sum"
            )
        value = value[()]
    if isinstance(value, Symbol):
        tables.update((table.name, table) for table in value.tables())
        return value.text(*names)
    if isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool):
        return repr(float(value))
    raise ValueError(f"{name_of(function)} returns {value!r}; it must return a number: check its return statement")


__all__ = ["Traced", "array", "formula_of", "velocity_names", "where"]
