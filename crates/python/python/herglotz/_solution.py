"""Results of a motion."""

from typing import NamedTuple

import numpy as np

from . import _core
from ._events import coordinates_with
from ._rows import Rows
from ._watch import Watch


class Crossings(NamedTuple):
    """The sign changes of an event, m of them."""

    t: np.ndarray  # (m,)
    q: np.ndarray  # (m, n)
    v: np.ndarray  # (m, n)
    p: np.ndarray  # (m, n)
    z: np.ndarray  # (m,)


class Resets(NamedTuple):
    """The resets of an event, m of them: the states before and after each."""

    t: np.ndarray  # (m,)
    q: np.ndarray  # (m, n)
    v: np.ndarray  # (m, n)
    p: np.ndarray  # (m, n)
    z: np.ndarray  # (m,)
    after_q: np.ndarray  # (m, n)
    after_v: np.ndarray  # (m, n)
    after_p: np.ndarray  # (m, n)
    after_z: np.ndarray  # (m,)


class States(NamedTuple):
    """States at m times, or at one."""

    t: np.ndarray  # (m,) or a number
    q: np.ndarray  # (m, n) or (n,)
    v: np.ndarray  # (m, n) or (n,)
    p: np.ndarray  # (m, n) or (n,)
    z: np.ndarray  # (m,) or a number
    energy: np.ndarray  # (m,) or a number


class Plan:
    """The plan of a run: what is computed and what is skipped; ``print`` shows it as text."""

    __slots__ = ("text", "integrator", "step", "steps", "error")

    def __init__(self, text, integrator, step, steps, error):
        self.text, self.integrator, self.step, self.steps, self.error = text, integrator, step, steps, error

    def __str__(self):
        return self.text

    def __repr__(self):
        return f"<Plan: {self.steps} steps of {self.step} by {self.integrator}>"


class Interrupted(KeyboardInterrupt):
    """A run that Ctrl-C has interrupted: ``solution`` has what was computed, and `Solution.resume` continues it.

    For an ensemble, ``solution`` has the members that had ended.
    """

    def __init__(self, solution):
        done = f"t = {solution.t_end}" if hasattr(solution, "t_end") else f"{sum(solution.success)} of {len(solution)} members"
        super().__init__(f"interrupted at {done}")
        self.solution = solution

    def __reduce__(self):
        return Interrupted, (self.solution,)


class Solution(Rows):
    """A motion of n coordinates with k rows; made by `solve`.

    Attributes
    ----------
    t : array of shape (k,)
    q, v, p : arrays of shape (k, n)
        Position, velocity and momentum.
    z, energy : arrays of shape (k,)
        The action, and the energy v.p - L.
    log_factor : array of shape (k,) or None
        The logarithm of the conformal factor since the start, where it was requested.
    events : list or dict of Crossings or Resets
        The sign changes of the events, in the order of the events or by name; for events with a reset the resets.
    status : str
        How the run ended; ``success`` is whether it ended as requested.
    unresolved : str or None
        The first step that was found not to resolve the motion.
    error_estimate : float or None
        The error at the end, where `estimate` was requested: that of (q, p) relative to its size, or that of v relative
        to the largest speed, whichever is larger; infinite where the run with half steps fails.
    steps, evaluations : int
        The number of steps taken, and of evaluations of forces or gradients.
    t_end : float
        The time that was reached.
    end : States
        The state that was reached, also where a terminal event or a callback ended the run between two rows.
    """

    def __init__(self, system, request, record, event_names, observed):
        self.system = system
        self._coordinates = coordinates_with(system, request[4])
        self._request = request
        self.t, self.q, self.v, self.p, self.z = record.t, record.q, record.v, record.p, record.z
        self.energy, self.log_factor = record.energy, record.log_factor
        self.status, self.success, self.unresolved = record.status, record.success, record.unresolved
        self.error_estimate = record.error_estimate
        self.steps, self.evaluations = record.steps, record.evaluations
        self._end, self._halted = record.end, record.halted
        self._observed = observed
        self._observed_rows = record.columns
        kinds = [Crossings if event[3] is None else Resets for event in request[4]]
        self.events = crossings(kinds, record.crossings, event_names, len(self._coordinates)) if event_names else []
        self._event_names = event_names
        self._plan = self._dense = None

    @property
    def t_end(self):
        return self._end[0]

    @property
    def end(self):
        """The state that was reached: at the final time, at a terminal event, or where the run was stopped.

        Returns
        -------
        States
            t, q, v, p, z, energy: of shapes () and (n,).
        """
        t, q, p, z, v = self._end
        if len(self.t) and self.t[-1] == t:
            return States(t, self.q[-1], self.v[-1], self.p[-1], float(self.z[-1]), float(self.energy[-1]))
        q, p, z = np.array(q), np.array(p), np.nan if z is None else z
        v = np.full(len(q), np.nan) if v is None else np.array(v)
        try:
            n = self.system.dimension
            if self.system.kind[0]:
                energy = _core.hamiltonian_geometry(self.system, (t, q, p, z))["hamiltonian"]
            else:
                energy = _core.geometry(self.system, (t, q[:n], v[:n], z))["energy"]
        except ValueError:
            # Systems whose geometry is not computed, as those with constraints; the motion is run once more.
            energy = float(self(t).energy)
        return States(t, q, v, p, z, energy)

    @property
    def plan(self):
        """The plan: what was computed and what was skipped; ``print(sol.plan)``."""
        if self._plan is None:
            self._plan = Plan(*_core.Motion(self.system, *self._request).plan())
        return self._plan

    def __getitem__(self, name):
        """A column by name: observed, a coordinate, a velocity ``x'``, ``t``, ``z``, ``energy`` or ``log_factor``."""
        if name in self._observed:
            return self._observed_rows[:, self._observed.index(name)]
        names = self._coordinates
        for array, of in ((self.q, names), (self.v, _core.velocity_names(self.system.given_coordinates)[1])):
            if name in of:
                return array[:, of.index(name)]
        if name in ("t", "z", "energy", "log_factor"):
            return getattr(self, name)
        raise KeyError(
            f"there is no column {name!r}: add it to `solve` with observe={{{name!r}: ...}}; the columns are "
            f"{self._names()}"
        )

    def _names(self):
        return [*self._coordinates, *_core.velocity_names(self.system.given_coordinates)[1], *self._observed]

    def __call__(self, t):
        """Dense output: the states at any times of the motion, as accurate as its steps.

        The first call runs the motion again and keeps the ends of its steps; a state within a step of collocation is on
        polynomials that resolve the motion, and for other integrators, or with ``exact=True``, it is computed by a
        shorter step. At the time of a reset the state is that before it.

        Parameters
        ----------
        t : float or array of shape (m,)

        Returns
        -------
        States
            t, q, v, p, z, energy: of shapes (m, n) and (m,), or (n,) and () for one time.
        """
        if self._dense is None:
            self._dense = _core.nodes(_core.Motion(self.system, *self._request), self.t_end)
        times = np.atleast_1d(np.asarray(t))
        q, v, p, z, energy, columns = self._dense.at(times, [])
        if np.ndim(t) == 0:
            return States(float(t), q[0], v[0], p[0], float(z[0]), float(energy[0]))
        return States(times.astype(float), q, v, p, z, energy)

    def resume(self, t=None, *, progress=False, callback=None, callback_interval=1.0):
        """Continues from the end of the motion, with the same arguments, events and columns.

        Parameters
        ----------
        progress, callback, callback_interval
            As in `solve`.
        t : float or array, optional
            The new final time; or the times of the rows, beyond the end of this motion, the first of which may be that
            end. By default the requested times that were not reached: a motion that Ctrl-C or a callback has interrupted
            then continues bitwise as if it had not been interrupted, with the remaining rows and crossings.

        Returns
        -------
        Solution
            The motion from the end of this one, which is its start: its derivatives in the start are those in the state there,
            with the momenta ``"p_x"`` in place of the velocities.
        """
        from ._solve import run

        watch = Watch(progress, callback, callback_interval)
        if t is None and self._halted is not None:
            halted = self._halted, self.t_end
            return run(self.system, self._request, self._event_names, self._observed, halted, watch=watch)

        if t is None and len(self.t) == 0 and not self.success:
            # The plan was interrupted.
            return run(self.system, self._request, self._event_names, self._observed, watch=watch)

        at, q, p, z, v = self._end
        if z is None:
            raise ValueError("the motion has no action from which it can continue")
        if t is None:
            asked = np.atleast_1d(np.asarray(self._request[1], dtype=float))
            start = asked[0] if len(asked) > 1 else 0.0
            t = asked[asked > at] if asked[-1] > start else asked[asked < at]
            if len(t) == 0:
                raise ValueError("the motion has reached its end: give a later `t`")
        times = np.array(t, dtype=float, ndmin=1)
        if len(times) == 0 or times[0] != at:
            times = np.concatenate([[at], times])
        _, _, every, way, events, columns, conformal_factor, estimate, scales, *more = self._request
        if way[3] is not None:
            # The number of steps was for another span.
            way = (None, way[1], self.plan.step, None)
        request = (q, p, True, z, v), times, every, way, events, columns, conformal_factor, estimate, scales, *more
        return run(self.system, request, self._event_names, self._observed, watch=watch)

    def sensitivity(self, variables):
        """The derivatives of the rows with respect to variables, forward, by the tangents of the steps.

        They are those of the discrete motion, to round-off: of the steps that were given, or chosen for the accuracy,
        whose number is fixed. The motion is run once more. Gauss methods have derivatives in all variables, across
        kinks, jumps and resets too; splittings and quadrature rules have most, for motions without them.

        Parameters
        ----------
        variables : str or list of str
            The names of m variables: parameters, coordinates ``"x"``, velocities ``"x'"`` or, where the start was given
            by `p0`, momenta ``"p_x"``, the action ``"z"``, the initial time ``"t0"`` for a fixed final time, and the
            final time ``"t_end"``. The coordinates and velocities of a function are ``"q[0]"`` and ``"v[0]"``.

        Returns
        -------
        Sensitivity
            q, v, p, z: of shapes (k, n) and (k,) for one name, (k, n, m) and (k, m) for a list; with the derivatives of
            the times of events, and of the end.

        Examples
        --------
        How the times of bounces, 2 v/g apart, depend on the restitution:

        >>> import herglotz as hz
        >>> floor = hz.Event("x", "falling", reset={"x'": "-e*x'"})
        >>> sol = hz.solve("x'^2/2 - 2*x", [0.0], [2.0], 3.6, coordinates=["x"], parameters={"e": 0.5}, events=floor)
        >>> sol.events[0].t.round(9), sol.sensitivity("e").event_times[0].round(9)
        (array([2. , 3. , 3.5]), array([0., 2., 4.]))
        """
        from ._sensitivity import sensitivity

        return sensitivity(self, variables)

    def pullback(self, q=None, v=None, p=None, z=None):
        """The gradient of a number with these partial derivatives in the rows, by the adjoint of the steps.

        The cost is a few runs for any number of variables; otherwise as `sensitivity`.

        Parameters
        ----------
        q, v, p : arrays of shape (k, n), or (n,) for the last row only
            The partial derivatives in position, velocity and momentum; those in v and p are added.
        z : array of shape (k,), or a number for the last row only

        Returns
        -------
        Gradient
        """
        from ._sensitivity import pullback

        return pullback(self, q, v, p, z)

    def lyapunov_exponents(self):
        """The Lyapunov exponents of the motion, by its tangent, made orthonormal after each step.

        The motion is run once more; otherwise as `sensitivity`.

        Returns
        -------
        LyapunovExponents

        Examples
        --------
        >>> import herglotz as hz
        >>> sol = hz.solve("pendulum", [1.0], [0.0], 100.0, integrator="gauss_8", step=0.25)
        >>> found = sol.lyapunov_exponents()
        >>> found.exponents.shape, bool(abs(found.pairs[0].sum() - found.rate) < 1e-12)
        ((3,), True)
        """
        from ._sensitivity import lyapunov_exponents

        return lyapunov_exponents(self)

    @property
    def momenta(self):
        """The momenta of the recognised symmetries, by name: arrays of shape (k,).

        Those of bodies are recognised where L depends on the differences of their coordinates: ``translation of x1,
        x2`` and ``rotation of (x1, y1), (x2, y2)``. They decay as the conformal factor: a momentum divided by
        exp(log_factor) is constant. With a force they are those along which the force does no work; with resets, which
        change momenta, there are none.
        """
        coordinates, found = self.system.coordinates, {}
        if any(event[3] is not None for event in self._request[4]):
            return found
        for which in self.system.symmetries:
            pairs = [", ".join(coordinates[i] for i in part) for part in which]
            if len(which[0]) == 1:
                found[f"translation of {', '.join(pairs)}"] = sum(self.p[:, i] for (i,) in which)
            else:
                name = f"rotation of {', '.join(f'({pair})' for pair in pairs) if len(pairs) > 1 else pairs[0]}"
                found[name] = sum(self.q[:, i] * self.p[:, j] - self.q[:, j] * self.p[:, i] for i, j in which)
        return found

    def _columns(self):
        columns = {name: self[name] for name in self._names()} | {"z": self.z, "energy": self.energy}
        return columns if self.log_factor is None else columns | {"log_factor": self.log_factor}

    def _arrays(self):
        data = {name: (("t", "coordinate"), getattr(self, name)) for name in ("q", "v", "p")}
        data |= {"z": ("t", self.z), "energy": ("t", self.energy)}
        if self.log_factor is not None:
            data["log_factor"] = ("t", self.log_factor)
        data |= {name: ("t", self[name]) for name in self._observed}
        attributes = {"lagrangian": self.system.lagrangian, "status": self.status}
        return data, {"coordinate": self._coordinates}, attributes

    def _plotted(self):
        return self._coordinates

    def __getstate__(self):
        # The ends of the steps are recomputed when they are needed.
        return self.__dict__ | {"_dense": None, "_plan": None}

    def __repr__(self):
        return f"<Solution: {len(self.t)} rows, t = {self.t_end}, {self.steps} steps, {self.status}>"


def crossings(kinds, found, names, n):
    """The crossings of each event: by name, or a list where `names` is a count.

    In `found` the event precedes t, and the state after a reset is the last entry.
    """

    def of(index):
        kind = kinds[index]
        before = kind._fields.index("t")
        mine = [(*crossing[:-1], *(crossing[-1] or ())) for crossing in found if crossing[before] == index]
        fields = [field for k, field in enumerate(zip(*mine)) if k != before] or [()] * len(kind._fields)
        arrays = (np.array(field, dtype=int if name == "member" else float) for name, field in zip(kind._fields, fields))
        return kind(*(x.reshape(-1, n) if name[-1] in "qvp" else x for name, x in zip(kind._fields, arrays)))

    if isinstance(names, int):
        return [of(index) for index in range(names)]
    return {name: of(index) for index, name in enumerate(names)}
