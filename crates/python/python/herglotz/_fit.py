"""Fits of motions to data."""

import numpy as np

from . import _core
from ._solve import request_of
from ._system import system as system_of

_LOSSES = "huber", "soft_l1", "cauchy"


class Fit:
    """The result of `fit`; ``print`` shows a table of the unknowns with their standard errors and correlations.

    Attributes
    ----------
    names : tuple of str
        The unknowns.
    x : array of shape (m,)
        Their values.
    errors : array of shape (m,)
        Their standard errors, scaled by the residuals unless `absolute_sigma` was given; NaN for those at bounds, and where the data do not determine the unknowns.
    at_bounds : dict
        "lower", "upper" or "fixed" for each unknown that is held there.
    covariance, correlation : array of shape (m, m), or None
        None where the data do not determine the unknowns.
    success : bool
        Whether a minimum was found that determines the unknowns; `status` says what was found instead.
    data, fitted, residuals : dict
        For each quantity its data, with the times in `t`, those of the fitted motion, and the residuals: fitted less
        measured values, divided by sigma where that is given.
    t : dict
        The times of the data of each quantity.
    jacobian : array of shape (k, m)
        The derivatives of all residuals.
    cost, residual_variance, degrees_of_freedom, rank, iterations, evaluations
        Half the sum of squares, each through the loss; its estimated variance, which is about 1 where sigma is right; the
        number of data less that of free unknowns; the rank of the Jacobian; and the work.
    system : System
        The system with the fitted parameters.
    q0, v0, p0, z0
        The fitted start; `v0` or `p0`, whichever was given.
    step : float
        The length of the steps of the fit.
    costs, best_start
        The cost from each start, NaN where it led to no fit, and the index of the best.
    largest_defect : float or None
        Of multiple shooting: how well the pieces of the motion meet, relative to its size.
    """

    def __init__(self, system, quantities, record):
        self.names, self.x = tuple(record.names), np.array(record.values)
        self.errors = np.array(record.errors)
        self.at_bounds = {name: bound for name, bound in zip(self.names, record.bounds) if bound is not None}
        self.covariance, self.correlation, self.jacobian = record.covariance, record.correlation, record.jacobian
        self.success, self.status = record.converged, record.status
        parts = ({name: parts[i] for name, parts in zip(quantities, record.series)} for i in range(4))
        self.t, self.data, self.fitted, self.residuals = parts
        self.cost, self.residual_variance = record.cost, record.residual_variance
        self.degrees_of_freedom, self.rank = record.degrees_of_freedom, record.rank
        self.iterations, self.evaluations = record.iterations, record.evaluations
        parameters = dict(record.parameters)
        self.system = system_of(system, parameters=parameters) if parameters else system
        q, rate, is_momentum, self.z0 = record.start
        self.q0, rate = np.array(q), np.array(rate)
        self.v0, self.p0 = (None, rate) if is_momentum else (rate, None)
        self.step, self.costs, self.best_start = record.step, np.array(record.costs), record.best_start
        self.largest_defect = record.largest_defect
        self._table = record.table

    def __getitem__(self, name):
        """The value of an unknown."""
        if name not in self.names:
            raise KeyError(f"there is no unknown {name!r}; the unknowns are {', '.join(self.names)}")
        return float(self.x[self.names.index(name)])

    def error(self, name):
        """The standard error of an unknown."""
        self[name]
        return float(self.errors[self.names.index(name)])

    def plot_residuals(self, *names, ax=None):
        """Plots residuals against time with matplotlib: those of the quantities named, or of all.

        Returns
        -------
        matplotlib.axes.Axes
        """
        import matplotlib.pyplot

        ax = matplotlib.pyplot.gca() if ax is None else ax
        for name in names or self.residuals:
            ax.plot(self.t[name], self.residuals[name], "o", label=name)
        ax.axhline(0.0, color="grey", linestyle=":")
        ax.set_xlabel("t")
        ax.set_ylabel("residual")
        ax.legend()
        return ax

    def __str__(self):
        return self._table

    def __repr__(self):
        values = ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.names, self.x))
        return f"<Fit: {values}, {self.status}>"


def fit(
    L=None,
    q0=None,
    v0=None,
    t=None,
    data=None,
    unknowns=None,
    *,
    events=None,
    t0=None,
    sigma=None,
    bounds=None,
    absolute_sigma=False,
    loss=None,
    nodes=(),
    starts=(),
    max_evaluations=None,
    H=None,
    p0=None,
    z0=0.0,
    accuracy=None,
    integrator=None,
    step=None,
    steps=None,
    scales=None,
    coordinates=None,
    parameters=None,
    force=None,
    rayleigh=None,
    tables=None,
    breaks=None,
    momenta=None,
    action=None,
    constraints=None,
    friction=None,
    project=False,
):
    """Fits parameters and the start of a motion to data, with the exact Jacobian of the computed motion.

    The method of Levenberg and Marquardt starts from the values that the motion has: `q0`, `v0` and the parameters. Steps
    that are chosen for an accuracy are chosen once, there.

    Parameters
    ----------
    L, q0, v0, H, p0, z0, accuracy, integrator, step, steps, scales, coordinates, parameters, force, rayleigh, tables, breaks,
    momenta, action, constraints, friction, project
        As in `solve`. Without an integrator it is a Gauss method, whose steps have derivatives.
    t : array of shape (k,)
        The times of the data.
    data : dict
        The data: a name or an expression of the state, as in `Solution.__getitem__`, with its values at `t`; NaN where
        it was not measured.
    unknowns : list of str
        What is fitted: parameters, and coordinates ``x``, velocities ``x'``, momenta ``p_x`` and ``z`` of the start.
    events : dict, optional
        Measured times of events, such as bounces or passages of a pendulum: a name with a pair of the `Event`, or its function,
        and the times of its sign changes from the first one on; NaN for one that was not measured. `t` and `data` may then be
        left out.
    t0 : float, optional
        The time of the start; the first of `t` by default, or 0 where only times of events are fitted.
    sigma : float, or dict of floats or arrays, optional
        The standard deviations of all data, or of each quantity. Without it all data have the same weight.
    absolute_sigma : bool
        Standard errors are scaled by the size of the residuals, so that only the ratios of sigma matter, as by default in
        `scipy.optimize.curve_fit`. With it they are those of the given sigma.
    bounds : dict of pairs, optional
        The lower and the upper bound of unknowns; equal for one that is held fixed.
    loss : tuple, optional
        A robust loss with the residual at which outliers begin, in units of sigma: ``("huber", 2.0)``, ``("soft_l1",
        2.0)`` or ``("cauchy", 2.0)``.
    nodes : array, optional
        Multiple shooting, for long or chaotic motions: the times at which the motion is cut.
    starts : list of dicts, optional
        Several starts, each with the values of some unknowns. The best fit is taken.
    max_evaluations : int, optional
        The largest number of evaluations from each start.

    Returns
    -------
    Fit

    Raises
    ------
    ValueError
        For an invalid argument, fewer data than unknowns, and a motion that cannot be computed or differentiated.

    Examples
    --------
    >>> import numpy as np, herglotz as hz
    >>> t = np.linspace(0, 10, 41)
    >>> x = hz.solve("x'^2/2 - k*x^2/2 + gamma*z", [1.0], [0.0], t, coordinates=["x"],
    ...              parameters={"k": 2.0, "gamma": -0.3}).q[:, 0]
    >>> found = hz.fit("x'^2/2 - k*x^2/2 + gamma*z", [1.0], [0.0], t, {"x": x}, ["k", "gamma"], coordinates=["x"],
    ...                parameters={"k": 1.5, "gamma": -0.1})
    >>> round(found["k"], 9), round(found["gamma"], 9)
    (2.0, -0.3)

    The restitution and the field of a ball, from the sounds of its bounces:

    >>> floor = hz.Event("x", "falling", reset={"x'": "-e*x'"})
    >>> found = hz.fit("x'^2/2 - g*x", [1.0], [0.0], unknowns=["e", "g"], coordinates=["x"], t0=0.0,
    ...                events={"bounce": (floor, [0.45, 1.17, 1.75, 2.21])}, parameters={"e": 0.7, "g": 9.0})
    >>> round(found["e"], 3), round(found["g"], 2)
    (0.8, 9.84)
    """
    if events is not None and t is None and data is None:
        times, data = np.empty(0), {}
        t0 = 0.0 if t0 is None else t0
    else:
        times = _vector("t", t)
        if not np.isfinite(times).all() or not len(times):
            raise ValueError("`t` must be the times of the data, finite numbers")
        t0 = float(times[0]) if t0 is None else t0
        if not hasattr(data, "items") or not data:
            raise ValueError(f'`data` is {data!r}; it must give values by name, as in data={{"x": x}}')
    events = _events(events, data)
    if isinstance(unknowns, str) or not unknowns or not all(isinstance(name, str) for name in unknowns):
        raise ValueError(f'`unknowns` is {unknowns!r}; it must be a list of names, as in ["gamma", "x"]')
    end = max([*times.tolist(), *(x for _, of in events.values() for x in of.tolist() if x == x)])
    if not end > t0:
        raise ValueError(f"the last of the data is at t = {end}, but the motion starts at {t0}; give data at later times")
    of, request, *_ = request_of(
        L, q0, v0, [t0, end], p0, z0, accuracy, integrator, step, steps, None,
        {name: event for name, (event, _) in events.items()}, None, False, False, scales,
        coordinates, parameters, force, rayleigh, tables, breaks,
        H=H, momenta=momenta, action=action, constraints=constraints, friction=friction, project=project,
        also=[str(name) for name in data],
    )  # fmt: skip
    names = [*data, *events]
    series = [_series(name, values, times, sigma, names) for name, values in data.items()]
    for k, (name, (_, values)) in enumerate(events.items()):
        numbers = np.flatnonzero(~np.isnan(values)).tolist()
        series.append((*_series(name, values, values, sigma, names)[:4], (k, numbers)))
    bounded = _bounds(bounds, unknowns)
    if absolute_sigma and any(of[3] is None for of in series):
        raise ValueError("`absolute_sigma` is given without `sigma` of all data: give it, or remove `absolute_sigma`")
    if loss is not None:
        loss = _loss(loss)
    motion = _core.Motion(of, *request)
    start = _start(of, request, unknowns)
    record = _core.fit_motion(
        motion,
        bounded,
        series,
        loss,
        _vector("nodes", nodes).tolist(),
        [_values(given, unknowns, start) for given in starts],
        max_evaluations,
        bool(absolute_sigma),
    )
    return Fit(of, names, record)


def _vector(name, x):
    try:
        found = np.asarray(x, dtype=float)
    except (TypeError, ValueError):
        found = None
    if found is None or found.ndim != 1:
        raise ValueError(f"`{name}` must be a list of numbers")
    return found


def _events(events, data):
    """Events with the times of their sign changes, by name."""
    if events is None:
        return {}
    form = "it must give pairs by name, as in events={\"bounce\": (hz.Event(...), times)}"
    if not hasattr(events, "items") or not events:
        raise ValueError(f"`events` is {events!r}; {form}")
    found = {}
    for name, pair in events.items():
        if not isinstance(pair, tuple) or len(pair) != 2:
            raise ValueError(f"events[{name!r}] is {pair!r}; {form}")
        if name in data:
            raise ValueError(f"`events` and `data` have both {name!r}; give one of them another name")
        times = _vector(f"the times of events[{name!r}]", pair[1])
        known = times[~np.isnan(times)]
        if not len(known) or not np.isfinite(known).all() or (np.diff(known) <= 0).any():
            raise ValueError(f"the times of events[{name!r}] must be finite and ascend; give NaN for one that was not measured")
        found[str(name)] = pair[0], times
    return found


def _series(name, values, times, sigma, data):
    values = _vector(f"data[{name!r}]", values)
    if len(values) != len(times):
        raise ValueError(f"data[{name!r}] has {len(values)} values, but `t` has {len(times)}")
    if np.isinf(values).any():
        raise ValueError(f"data[{name!r}] is infinite; give finite numbers, and NaN where it was not measured")
    known = ~np.isnan(values)
    given = sigma
    if hasattr(sigma, "items"):
        if unknown := [key for key in sigma if key not in data]:
            raise ValueError(f"`sigma` has {unknown[0]!r}, of which there are no data; the data are {', '.join(data)}")
        given = sigma.get(name)
    deviations = None
    if given is not None:
        deviations = np.asarray(given, dtype=float)
        if deviations.shape not in ((), times.shape):
            raise ValueError(f"the sigma of {name!r} must be a number, or as many as there are times")
        deviations = np.broadcast_to(deviations, times.shape)[known]
        if not (deviations > 0).all():
            raise ValueError(f"the sigma of {name!r} must be positive")
        deviations = deviations.tolist()
    return name, times[known].tolist(), values[known].tolist(), deviations, None


def _bounds(bounds, unknowns):
    bounds = {} if bounds is None else dict(bounds)
    _check_names("bounds", bounds, unknowns)
    pairs = ((name, bounds.get(name, (-np.inf, np.inf))) for name in unknowns)
    return [(name, *map(float, pair)) for name, pair in pairs]


def _loss(loss):
    if isinstance(loss, tuple) and len(loss) == 2 and loss[0] in _LOSSES:
        return loss[0], float(loss[1])
    known = ", ".join(map(repr, _LOSSES))
    raise ValueError(f'`loss` is {loss!r}; it must be one of {known} with its scale, as in ("huber", 2.0)')


def _start(of, request, unknowns):
    """The values of the unknowns in the motion."""
    (q, rate, is_momentum, z, _), names = request[0], of.coordinates
    q, rate = (np.ravel(np.asarray(x, dtype=float)) for x in (q, rate))
    rates = [f"p_{name}" for name in names] if is_momentum else _core.velocity_names(of.given_coordinates)[1]
    # Coordinates and velocities by their index, as in formulas, unless these are names of their own.
    known = {f"{letter}[{i}]": x for letter, part in (("q", q), ("v", rate)) for i, x in enumerate(part)}
    known |= dict(of.parameters) | {"z": float(z)} | dict(zip(names, q)) | dict(zip(rates, rate))
    return {name: known.get(name.removeprefix("start.")) for name in unknowns}


def _values(given, unknowns, start):
    if not hasattr(given, "items"):
        raise ValueError(f"a start is {given!r}; it must be a dict of values of unknowns")
    _check_names("starts", given, unknowns)
    values = start | dict(given)
    if missing := [name for name in unknowns if values[name] is None]:
        raise ValueError(f"a start has no value of {missing[0]!r}; add it")
    return [float(values[name]) for name in unknowns]


def _check_names(what, given, unknowns):
    if unknown := [name for name in given if name not in unknowns]:
        raise ValueError(f"`{what}` has {unknown[0]!r}, which is no unknown; the unknowns are {', '.join(unknowns)}")
