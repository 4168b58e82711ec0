"""Ensembles: many motions of one Lagrangian."""

from typing import NamedTuple

import numpy as np

from . import _core
from ._additions import breaks_of
from ._events import coordinates_with, events_of, has_reset, texts_of_events
from ._rows import axes_of
from ._solution import Interrupted, crossings
from ._solve import columns_of, functions_of, system_and_start
from ._system import Composed, check_used, copied, warn_of_gain, with_tables
from ._watch import Watch


def ensemble(
    L=None,
    q0=None,
    v0=None,
    t=None,
    *,
    H=None,
    p0=None,
    z0=0.0,
    accuracy=None,
    integrator=None,
    step=None,
    steps=None,
    events=(),
    observe=None,
    coordinates=None,
    parameters=None,
    threads=None,
    force=None,
    rayleigh=None,
    tables=None,
    breaks=None,
    momenta=None,
    action=None,
    constraints=None,
    progress=False,
):
    """M motions of one Lagrangian on several threads; the result does not depend on the number of threads.

    Parameters
    ----------
    L : function, str, SymPy expression or System
        As in `solve`.
    q0, v0 : arrays of shape (M, n)
        Initial positions and velocities.
    t : float or array of shape (k,)
        The final time of motions from 0, or initial and final time: then the final states are returned. With more than
        two times, the states at all of them.
    p0 : array of shape (M, n), optional
        The initial momenta, in place of `v0`.
    z0 : float or array of shape (M,)
    parameters : dict of float or arrays of shape (M,), optional
        Parameters given as arrays differ among the members.
    events : str, Event, or a list or dict of them
        As in `solve`; their results also have the member. A terminal event ends the motion of its member only.
    threads : int, optional
        By default the number of processors.
    progress : bool
        As in `solve`: the part of the members that have ended.
    H, momenta, action, constraints
        As in `solve`.
    accuracy, integrator, step, steps, observe, coordinates, force, rayleigh, tables, breaks
        As in `solve`.

    Returns
    -------
    Ensemble

    Raises
    ------
    ValueError
        For an invalid argument.
    Interrupted
        A `KeyboardInterrupt` with the ensemble: the members that had ended, and the others without success.
    """
    arguments = locals()
    if isinstance(L, Composed) and hasattr(L, "_ensemble"):
        return L._ensemble(arguments)
    watch = Watch(progress, None, 1.0)
    system, request, columns = request_of(
        L, q0, v0, t, p0, z0, accuracy, integrator, step, steps, events, observe, coordinates, parameters, threads, force,
        rayleigh, tables, breaks, H, momenta, action, constraints,
    )  # fmt: skip
    start, t, way, varied, values, threads, given = request

    def call(watched):
        shown = watched and watched[0]
        return _core.run_ensemble(system, start, t, way, varied, values, given, columns, threads, shown)

    record = watch.run(call)
    event_names = tuple(events) if isinstance(events, dict) else len(given)
    found = Ensemble(system, record, event_names, tuple(observe or ()), request)
    if record.interrupted is not None:
        if isinstance(record.interrupted, KeyboardInterrupt):
            raise Interrupted(found)
        raise record.interrupted
    return found


def request_of(
    L,
    q0,
    v0,
    t,
    p0,
    z0,
    accuracy,
    integrator,
    step,
    steps,
    events,
    observe,
    coordinates,
    parameters,
    threads,
    force,
    rayleigh,
    tables,
    breaks,
    H=None,
    momenta=None,
    action=None,
    constraints=None,
):
    """The system and the request for the arguments of `ensemble`, and the columns."""
    if parameters is not None and not hasattr(parameters, "items"):
        raise ValueError(f"`parameters` is {parameters!r}; it must give values by name, as in parameters={{\"gamma\": -0.1}}")
    parameters = dict(parameters or {})
    varied = {name: value for name, value in parameters.items() if np.ndim(value)}
    # The formula needs some value of each parameter; any of the member's values will do.
    fixed = {
        name: float(np.ravel(value)[0]) if name in varied and np.size(value) else value
        for name, value in parameters.items()
    }
    if np.ndim(q0) != 2:
        raise ValueError(f"`q0` has {np.ndim(q0)} dimensions; it must have the shape (M, n), with a row for each member")
    more, kind = (force, rayleigh, tables, breaks, constraints, None), (H, momenta, action)
    system, _, _ = system_and_start(L, np.zeros(np.shape(q0)[1]), v0, p0, coordinates, fixed, more, kind)
    if t is None:
        raise ValueError("`t` is not given: give the final time, or several times")
    if (v0 is None) == (p0 is None):
        raise ValueError("give either `v0` or `p0`")
    if breaks is not None:
        breaks_of(breaks, t)
    found = {}
    given = events_of(events, system, found) if events else []
    columns = columns_of(observe, system, found)
    system = with_tables(system, found)
    if parameters or tables:
        functions = (L if H is None else H, *functions_of(force, rayleigh))
        check_used(system, parameters, tables, functions, [*texts_of_events(given), *columns])
    if "gamma" in system.parameters and len(q0):
        rate = v0 if p0 is None else p0
        warn_of_gain(system, q0[0], rate[0] if np.ndim(rate) == 2 else None, values=parameters.get("gamma"))
    values = list(map(copied, varied.values()))
    start = (copied(q0), copied(v0), False, copied(z0)) if p0 is None else (copied(q0), copied(p0), True, copied(z0))
    request = start, copied(t), (accuracy, integrator, step, steps), list(varied), values, threads, given
    return system, request, columns


class MemberCrossings(NamedTuple):
    """The sign changes of an event in an ensemble, m of them."""

    member: np.ndarray  # (m,)
    t: np.ndarray  # (m,)
    q: np.ndarray  # (m, n)
    v: np.ndarray  # (m, n)
    p: np.ndarray  # (m, n)
    z: np.ndarray  # (m,)


class MemberResets(NamedTuple):
    """The resets of an event in an ensemble, m of them: the states before and after each."""

    member: np.ndarray  # (m,)
    t: np.ndarray  # (m,)
    q: np.ndarray  # (m, n)
    v: np.ndarray  # (m, n)
    p: np.ndarray  # (m, n)
    z: np.ndarray  # (m,)
    after_q: np.ndarray  # (m, n)
    after_v: np.ndarray  # (m, n)
    after_p: np.ndarray  # (m, n)
    after_z: np.ndarray  # (m,)


class Ensemble:
    """M motions of n coordinates; made by `ensemble`.

    Attributes
    ----------
    q, v, p : arrays of shape (M, n), or (M, k, n) at k times
    z : array of shape (M,) or (M, k)
    t : array of shape (M,)
        The times that were reached.
    times : array of shape (k,) or None
    events : list or dict of MemberCrossings or MemberResets
        The sign changes of the events, in the order of the events or by name: those of all members, one after the
        other. For events with a reset these are the resets.
    steps : array of int of shape (M,)
    success : array of bool of shape (M,)
    troubles : dict of str
        Errors and warnings, by the index of the member; values that were not computed are NaN.
    batch_kernel : int
        The number of members that were advanced together in SIMD lanes.
    own_plans : int
        With an accuracy, the number of the other members: their steps were selected for each by itself.
    """

    def __init__(self, system, record, event_names, observed, request):
        self.system, self._request, self._coordinates = system, request, coordinates_with(system, request[6])
        events = request[6]
        self.t, self.steps, self.success, self.times = record.t, record.steps, record.success, record.times
        self.troubles, self.batch_kernel, self.own_plans = dict(record.troubles), record.batch_kernel, record.own_plans
        count, n = len(record.t), len(self._coordinates)
        many = () if self.times is None else (len(self.times),)
        self.q, self.v, self.p = (x.reshape(count, *many, n) for x in (record.q, record.v, record.p))
        self.z = record.z.reshape(count, *many)
        kinds = [MemberResets if has_reset(event) else MemberCrossings for event in events]
        self.events = crossings(kinds, record.crossings, event_names, n) if event_names else []
        self._observed = {name: record.columns[:, i].reshape(count, *many) for i, name in enumerate(observed)}

    def __len__(self):
        return len(self.t)

    def __getitem__(self, name):
        """A column by name, of shape (M,) or (M, k): observed, a coordinate, a velocity ``x'`` or ``z``."""
        if name in self._observed:
            return self._observed[name]
        columns = self._columns()
        if name not in columns:
            raise KeyError(f"there is no column {name!r}: add it to `ensemble` with observe={{{name!r}: ...}}; the columns are {[*columns]}")
        return columns[name]

    def _columns(self):
        names, velocities = self._coordinates, _core.velocity_names(self.system.given_coordinates)[1]
        columns = {}
        for of, array in ((names, self.q), (velocities, self.v), ([f"p_{name}" for name in names], self.p)):
            columns |= {name: array[..., i] for i, name in enumerate(of)}
        return columns | {"z": self.z} | self._observed

    def sensitivity(self, variables):
        """The derivatives of the rows of all members with respect to variables, as `Solution.sensitivity` has them.

        Each member is run once more, by itself, on several threads; for an accuracy the steps are chosen for each. The
        result does not depend on the number of threads. Members may have resets, but no terminal events. With two times or a single one there are two rows: the start
        and the end.

        Parameters
        ----------
        variables : str or list of str
            As in `Solution.sensitivity`.

        Returns
        -------
        EnsembleSensitivity
        """
        from ._ensemble_derivatives import sensitivity

        return sensitivity(self, variables)

    def pullback(self, q=None, v=None, p=None, z=None):
        """The gradients of numbers with these partial derivatives in the rows of each member, by the adjoint.

        Otherwise as `sensitivity`.

        Parameters
        ----------
        q, v, p : arrays of shape (M, k, n), or (M, n) for the last rows only
            The partial derivatives in position, velocity and momentum; those in v and p are added.
        z : array of shape (M, k), or (M,) for the last rows only

        Returns
        -------
        EnsembleGradient
        """
        from ._ensemble_derivatives import pullback

        return pullback(self, q, v, p, z)

    def to_pandas(self):
        """The rows as a `pandas.DataFrame`, whose index is the member, or the member and t where there are several times."""
        import pandas

        columns = {name: column.ravel() for name, column in self._columns().items()}
        if self.times is None:
            return pandas.DataFrame({"t": self.t} | columns, index=pandas.RangeIndex(len(self), name="member"))
        index = pandas.MultiIndex.from_product([range(len(self)), self.times], names=["member", "t"])
        return pandas.DataFrame(columns, index=index)

    def to_xarray(self):
        """The rows as an `xarray.Dataset` with axes for member, coordinate and, where there are several of them, time."""
        import xarray

        along = ("member",) if self.times is None else ("member", "t")
        data = {name: ((*along, "coordinate"), getattr(self, name)) for name in ("q", "v", "p")}
        data |= {"z": (along, self.z)} | {name: (along, column) for name, column in self._observed.items()}
        data |= {"success": ("member", self.success), "steps": ("member", self.steps)}
        axes = {"coordinate": self._coordinates}
        if self.times is None:
            data["reached"] = ("member", self.t)
        else:
            axes["t"] = self.times
        return xarray.Dataset(data, axes, {"lagrangian": self.system.lagrangian})

    def plot(self, coordinate=0, ax=None):
        """Plots a coordinate with matplotlib: against time, a line for each member, or with its velocity at the ends.

        Returns
        -------
        matplotlib.axes.Axes
        """
        ax = axes_of(ax)
        names, velocities = self._coordinates, _core.velocity_names(self.system.given_coordinates)[1]
        i = names.index(coordinate) if isinstance(coordinate, str) else coordinate
        if self.times is None:
            ax.plot(self.q[:, i], self.v[:, i], ".", markersize=3)
            ax.set(xlabel=names[i], ylabel=velocities[i])
        else:
            ax.plot(self.times, self.q[..., i].T, linewidth=0.8)
            ax.set(xlabel="t", ylabel=names[i])
        return ax

    def __repr__(self):
        return f"<Ensemble: {len(self)} members, {int(np.sum(~self.success))} without success>"
