"""What a motion has led to."""

from typing import NamedTuple

import numpy as np

from . import _core


class Crossings(NamedTuple):
    """The changes of sign of an event: m of them."""

    t: np.ndarray  # (m,)
    q: np.ndarray  # (m, n)
    v: np.ndarray  # (m, n)
    p: np.ndarray  # (m, n)
    z: np.ndarray  # (m,)


class Plan:
    """What a run computes and skips; printed, in words."""

    __slots__ = ("text", "integrator", "step", "steps", "error")

    def __init__(self, text, integrator, step, steps, error):
        self.text, self.integrator, self.step, self.steps, self.error = text, integrator, step, steps, error

    def __str__(self):
        return self.text

    def __repr__(self):
        return f"<Plan: {self.steps} steps of {self.step} by {self.integrator}>"


class Interrupted(KeyboardInterrupt):
    """A run that Ctrl-C has ended: ``solution`` has what was computed, and `Solution.resume` goes on with it."""

    def __init__(self, solution):
        super().__init__(f"interrupted at t = {solution.t_end}")
        self.solution = solution

    def __reduce__(self):
        return Interrupted, (self.solution,)


class Solution:
    """A motion of n coordinates with k rows; made by `solve`.

    Attributes
    ----------
    t : array of shape (k,)
    q, v, p : arrays of shape (k, n)
        Position, velocity and momentum.
    z, energy : arrays of shape (k,)
        The action, and the energy v.p - L.
    log_factor : array of shape (k,) or None
        The logarithm of the conformal factor since the start, where it was asked for.
    events : list or dict of Crossings
        The changes of sign of the events, in their order or by their names.
    status : str
        How the run ended; ``success`` says whether as it was asked to.
    suspicion : str or None
        The first step that was seen not to resolve the motion.
    steps, evaluations : int
        The steps taken, and the evaluations of forces or gradients.
    t_end : float
        The time reached.
    """

    def __init__(self, system, request, record, events, observed):
        self.system = system
        self._request = request
        self.t, self.q, self.v, self.p, self.z = record.t, record.q, record.v, record.p, record.z
        self.energy, self.log_factor = record.energy, record.log_factor
        self.status, self.success, self.suspicion = record.status, record.success, record.suspicion
        self.steps, self.evaluations = record.steps, record.evaluations
        self._end = record.end
        self._observed = observed
        self._columns = record.columns
        self.events = _crossings(record.crossings, events, system.dimension) if events else []
        self._plan = None

    @property
    def t_end(self):
        return self._end[0]

    @property
    def plan(self):
        """What was computed and what was skipped; ``print(sol.plan)``."""
        if self._plan is None:
            self._plan = Plan(*_core.Motion(self.system, *self._request).plan())
        return self._plan

    def __getitem__(self, name):
        """An observed column by its name: an array of shape (k,)."""
        if name in self._observed:
            return self._columns[:, self._observed.index(name)]
        raise KeyError(name)

    def __repr__(self):
        return f"<Solution: {len(self.t)} rows, t = {self.t_end}, {self.steps} steps, {self.status}>"


def _crossings(found, events, n):
    names = list(events) if isinstance(events, dict) else None
    count = 1 if not isinstance(events, (list, tuple, dict)) else len(events)

    def of(index):
        mine = [crossing for crossing in found if crossing[0] == index]
        numbers = [np.array([crossing[k] for crossing in mine]) for k in range(1, 6)]
        return Crossings(*(x.reshape(-1, n) if k in (1, 2, 3) else x for k, x in enumerate(numbers)))

    each = [of(index) for index in range(count)]
    return dict(zip(names, each)) if names is not None else each
