"""Systems of many coordinates: lattices given by the formulas of a site and of a bond, and gravitating bodies."""

import functools
import re

import numpy as np

from . import _core
from ._rows import Rows, axes_of
from ._solution import Interrupted, States
from ._system import copied, warn_of_gain, warn_of_positive
from ._watch import Watch


class SparseSolution(Rows):
    """A motion of many coordinates with k rows; made by `lattice` and `bodies`.

    Attributes
    ----------
    t : array of shape (k,)
    q, v, p : arrays of shape (k, *sites), (k, *sites, components) or (k, bodies, dimensions)
        Position, velocity and momentum; the axes after the first are those of the initial position.
    z, energy : arrays of shape (k,)
        The action, and the energy v.p - L.
    log_factor : array of shape (k,) or None
        The logarithm of the conformal factor since the start, where it was requested.
    status : str
        How the run ended; ``success`` is whether it ended as requested.
    unresolved : str or None
        The first step that was found not to resolve the motion.
    steps, evaluations : int
        The number of steps taken, and of evaluations of all forces.
    t_end : float
        The time that was reached.
    end : States
        The state that was reached.
    """

    def __init__(self, run, request, shape, record, bodies):
        self._run, self._request, self._shape, self._bodies = run, request, shape, bodies
        self.t, self.z, self.energy, self.log_factor = record.t, record.z, record.energy, record.log_factor
        self.q, self.v, self.p = (x.reshape(-1, *shape) for x in (record.q, record.v, record.p))
        self.status, self.success, self.unresolved = record.status, record.success, record.unresolved
        self.steps, self.evaluations = record.steps, record.evaluations
        self._end = record.end

    @property
    def t_end(self):
        return self._end[0]

    @property
    def end(self):
        """The state that was reached, as `States`: q, v and p with the axes of the initial position.

        The energy is NaN where a run was stopped between two rows.
        """
        t, q, p, z, v = self._end
        q, v, p = (np.array(x).reshape(self._shape) for x in (q, v, p))
        is_row = len(self.t) and self.t[-1] == t
        return States(t, q, v, p, z, float(self.energy[-1]) if is_row else np.nan)

    @property
    def momenta(self):
        """The total momenta of bodies, by name: arrays of shape (k,); empty for a lattice.

        "translation of x" and so on are the components of the total momentum, "rotation of x, y" and so on those of the
        total angular momentum. They decay as the conformal factor e^(gamma t).
        """
        if not self._bodies:
            return {}
        names = "xyz"[: self._shape[-1]]
        found = {f"translation of {name}": self.p[..., i].sum(axis=1) for i, name in enumerate(names)}
        for j in range(len(names)):
            for i in range(j):
                turned = self.q[..., i] * self.p[..., j] - self.q[..., j] * self.p[..., i]
                found[f"rotation of {names[i]}, {names[j]}"] = turned.sum(axis=1)
        return found

    def resume(self, t=None, *, progress=False, callback=None, callback_interval=1.0):
        """Continues from the end of the motion, with the same integrator and steps of the same length.

        Parameters
        ----------
        progress, callback, callback_interval
            As in `solve`.
        t : float or array, optional
            The new final time; or the times of the rows, beyond the end of this motion, the first of which may be that
            end. By default the requested times that were not reached.

        Returns
        -------
        SparseSolution
            The motion from the end of this one.
        """
        watch = Watch(progress, callback, callback_interval)
        at, q, p, z, _ = self._end
        _, asked, every, (integrator, step, steps), conformal_factor = self._request
        asked = np.atleast_1d(np.asarray(asked, dtype=float))
        start = asked[0] if len(asked) > 1 else 0.0
        if t is None:
            t = asked[asked > at] if asked[-1] > start else asked[asked < at]
            if len(t) == 0:
                raise ValueError("the motion has reached its end: give a later `t`")
        times = np.array(t, dtype=float, ndmin=1)
        if len(times) == 0 or times[0] != at:
            times = np.concatenate([[at], times])
        if steps is not None:
            # The number of steps was for another span.
            step, steps = abs(asked[-1] - start) / steps, None
        request = (q, p, True, z), times, every, (integrator, step, steps), conformal_factor
        return _solution(self._run, request, self._shape, self._bodies, watch)

    def __getitem__(self, name):
        """A column by name, of shape (k,): ``"q[0]"``, ``"v[3, 1]"``, ``"z"``, ``"energy"``, ``"t"``, ``"log_factor"``."""
        # Without the other columns, of which there may be millions.
        found = re.fullmatch(r"([qvp])\[([0-9]+(?:, ?[0-9]+)*)\]", name)
        index = tuple(map(int, found[2].split(","))) if found else ()
        if found and len(index) == len(self._shape) and all(i < n for i, n in zip(index, self._shape)):
            return getattr(self, found[1])[(slice(None), *index)]
        if name in ("t", "z", "energy") or name == "log_factor" and self.log_factor is not None:
            return getattr(self, name)
        last = ", ".join(str(n - 1) for n in self._shape)
        raise KeyError(f"there is no column {name!r}; the columns are t, z, energy, and q, v and p with an index up to [{last}]")

    def _columns(self):
        columns = {}
        for letter in "qvp":
            array = getattr(self, letter)
            for index in np.ndindex(*self._shape):
                columns[f"{letter}[{', '.join(map(str, index))}]"] = array[(slice(None), *index)]
        columns |= {"z": self.z, "energy": self.energy}
        return columns if self.log_factor is None else columns | {"log_factor": self.log_factor}

    def _arrays(self):
        names = ["body", "component"] if self._bodies else [f"site_{i}" for i in range(len(self._shape))]
        data = {name: (("t", *names), getattr(self, name)) for name in ("q", "v", "p")}
        data |= {"z": ("t", self.z), "energy": ("t", self.energy)}
        if self.log_factor is not None:
            data["log_factor"] = ("t", self.log_factor)
        return data, {}, {"status": self.status}

    def plot(self, *names, ax=None):
        """Plots columns such as ``"q[0]"`` and ``"energy"`` against time with matplotlib.

        Without names: the paths of bodies in the plane of their first two coordinates; the positions of a line of sites
        over site and time; the last positions of other lattices over their first two axes.

        Returns
        -------
        matplotlib.axes.Axes
        """
        if names:
            return super().plot(*names, ax=ax)
        ax = axes_of(ax)
        if self._bodies:
            for i in range(self._shape[0]):
                ax.plot(self.q[:, i, 0], self.q[:, i, 1], label=f"body {i}")
            ax.set(xlabel="x", ylabel="y", aspect="equal")
        elif len(self._shape) == 1:
            image = ax.pcolormesh(np.arange(self._shape[0]), self.t, self.q, shading="nearest")
            ax.set(xlabel="site", ylabel="t")
            ax.figure.colorbar(image, ax=ax, label="q")
        else:
            last = self.q[-1].reshape(*self._shape[:2], -1)[..., 0]
            image = ax.pcolormesh(last.T, shading="auto")
            ax.set(xlabel="first axis", ylabel="second axis", title=f"q at t = {self.t[-1]:g}")
            ax.figure.colorbar(image, ax=ax, label="q")
        return ax

    def __repr__(self):
        return f"<SparseSolution: {len(self.t)} rows of {self._shape}, t = {self.t_end}, {self.steps} steps, {self.status}>"


def lattice(
    site,
    bond=None,
    q0=None,
    v0=None,
    t=None,
    *,
    p0=None,
    z0=0.0,
    boundary="periodic",
    integrator="strang",
    step=None,
    steps=None,
    every=None,
    conformal_factor=False,
    coordinates=("x",),
    parameters=None,
    progress=False,
    callback=None,
    callback_interval=1.0,
):
    """The motion of a lattice of equal sites with bonds between neighbours, with any number of sites.

    Its Lagrangian is the sum of `site` over the sites, of `bond` over the pairs of neighbours along each axis, and of
    the drag gamma(t) z. The drag is written in `site`, so that each site satisfies its own Herglotz equation; z is the
    action of the whole lattice, and the term counts once.

    Parameters
    ----------
    site : str
        The Lagrangian of a site, of the form m*x'^2/2 - V(t, x) + gamma*z: ``"x'^2/2 - (1 - cos(x)) + gamma*z"``.
    bond : str, optional
        The Lagrangian of a bond, in the coordinates before and after it, without velocities: ``"-k*(xr - xl)^2/2"``.
    q0, v0 : array of shape (sites,), (sites, sites) and so on
        Initial position and velocity, with an axis for each direction of the lattice; several coordinates of a site are
        the last axis. A single number `v0` is the velocity of all coordinates.
    t : float or array of shape (k,)
        The times of the rows: the first is the initial time, the last the final time, in either direction. A single
        number is the final time of a motion from 0.
    p0 : array, optional
        The initial momentum, in place of `v0`.
    z0 : float
        The initial action.
    boundary : {"periodic", "fixed", "free"}
        The boundary condition along each axis: periodic, walls at 0, or free ends.
    integrator : str
        A splitting such as "strang" or "blanes_moan_6", which is explicit; or "midpoint", "gauss_1" or "gauss_2", for
        stiff bonds.
    step, steps : float, int
        The length or the number of the steps; give one of them.
    every : int, optional
        Record a row every `every` steps, in place of the rows at `t`.
    conformal_factor : bool
        Whether `SparseSolution.log_factor` is computed.
    coordinates : list of str
        The names of the components at a site, 1 to 3 of them; ``xl`` and ``xr`` are those of ``x`` in a bond.
    parameters : dict of float, optional
        The values of the parameters by name.
    progress, callback, callback_interval
        As in `solve`.

    Returns
    -------
    SparseSolution

    Raises
    ------
    ValueError
        For an invalid argument.
    Interrupted
        A `KeyboardInterrupt` with the solution up to the interruption.

    Examples
    --------
    A wave in a thousand pendulums coupled by springs:

    >>> import numpy as np, herglotz as hz
    >>> x = np.arange(1000)
    >>> sol = hz.lattice("x'^2/2 - (1 - cos(x)) + gamma*z", "-(xr - xl)^2/2", 3*np.exp(-(x - 500)**2/100), 0.0,
    ...                  np.linspace(0, 50, 101), step=0.05, parameters={"gamma": -0.01})
    >>> sol.q.shape
    (101, 1000)
    """
    watch = Watch(progress, callback, callback_interval)
    coordinates = [coordinates] if isinstance(coordinates, str) else list(coordinates)
    for name, of, example in (("site", site, "x'^2/2 - (1 - cos(x)) + gamma*z"), ("bond", bond, "-k*(xr - xl)^2/2")):
        if not isinstance(of, str) and (name == "site" or of is not None):
            raise TypeError(
                f"`{name}` is {of!r}; a lattice is written by formulas, as in {name}=\"{example}\", and takes no functions: "
                "functions are for `solve`"
            )
    q0, request = _request(q0, v0, p0, z0, t, every, integrator, step, steps, conformal_factor)
    sizes = q0.shape
    if len(coordinates) > 1:
        if sizes[-1:] != (len(coordinates),):
            raise ValueError(f"`q0` has the shape {sizes}; its last axis must have the {len(coordinates)} coordinates of a site")
        sizes = sizes[:-1]
    parameters = dict(parameters) if parameters else None
    run = functools.partial(_run_lattice, (coordinates, site, bond), sizes, boundary, parameters)
    found = _solution(run, request, q0.shape, False, watch)
    if parameters and "gamma" in parameters:
        warn_of_gain(_core.System(site, coordinates, parameters), np.zeros(len(coordinates)))
    return found


def bodies(
    masses,
    q0,
    v0=None,
    t=None,
    *,
    p0=None,
    G=1.0,
    gamma=0.0,
    z0=0.0,
    integrator="blanes_moan_6",
    step=None,
    steps=None,
    every=None,
    conformal_factor=False,
    progress=False,
    callback=None,
    callback_interval=1.0,
):
    """The motion of any number of bodies with Newtonian gravitation of each pair and linear drag.

    L = sum m_i |v_i|^2/2 + sum_(i<j) G m_i m_j/|q_i - q_j| + gamma z. All steps have the same length, which must
    resolve the closest encounter. A few bodies (up to 5 in space or 8 in the plane) can also be given to `solve`, which
    chooses its steps.

    Parameters
    ----------
    masses : array of shape (bodies,)
    q0, v0 : array of shape (bodies, 2) or (bodies, 3)
        Initial position and velocity. A single number `v0` is the velocity of all coordinates.
    t : float or array of shape (k,)
        The times of the rows: the first is the initial time, the last the final time, in either direction. A single
        number is the final time of a motion from 0.
    p0 : array, optional
        The initial momentum, in place of `v0`.
    G : float
        The gravitational constant.
    gamma : float
        The rate of the drag, negative for dissipation: momentum and angular momentum decay as e^(gamma t).
    z0 : float
        The initial action.
    integrator : str
        A splitting such as "blanes_moan_6" or "strang", or "midpoint".
    step, steps : float, int
        The length or the number of the steps; give one of them.
    every : int, optional
        Record a row every `every` steps, in place of the rows at `t`.
    conformal_factor : bool
        Whether `SparseSolution.log_factor` is computed.
    progress, callback, callback_interval
        As in `solve`.

    Returns
    -------
    SparseSolution

    Raises
    ------
    ValueError
        For an invalid argument.
    Interrupted
        A `KeyboardInterrupt` with the solution up to the interruption.
    """
    watch = Watch(progress, callback, callback_interval)
    q0, request = _request(q0, v0, p0, z0, t, every, integrator, step, steps, conformal_factor)
    masses = _array("masses", masses)
    warn_of_positive(gamma)
    if q0.ndim != 2 or len(q0) != len(masses):
        raise ValueError(f"`q0` has the shape {q0.shape}; it must have a row for each of the {len(masses)} bodies")
    run = functools.partial(_run_bodies, masses, q0.shape[1], G, gamma)
    return _solution(run, request, q0.shape, True, watch)


# These functions are defined in the module so that a solution can be pickled.
def _run_lattice(*arguments):
    return _core.run_lattice(*arguments)


def _run_bodies(*arguments):
    return _core.run_bodies(*arguments)


def _array(name, x):
    """The numbers of an argument, copied."""
    try:
        return np.array(x, dtype=float, ndmin=1)
    except (TypeError, ValueError) as error:
        raise ValueError(f"`{name}` must be an array of real numbers: {error}") from None


def _request(q0, v0, p0, z0, t, every, integrator, step, steps, conformal_factor):
    """The initial position with its shape, and the request in the form of the core."""
    if q0 is None:
        raise ValueError("`q0` is not given: give the initial position")
    if t is None:
        raise ValueError("`t` is not given: give the final time, or the times of the rows")
    if (v0 is None) == (p0 is None):
        raise ValueError("give either `v0` or `p0`")
    q0 = _array("q0", q0)
    name, rate = ("v0", v0) if p0 is None else ("p0", p0)
    of_all, rate = np.ndim(rate) == 0, _array(name, rate)
    if not of_all and rate.shape != q0.shape:
        raise ValueError(f"`{name}` has the shape {rate.shape}, but `q0` has {q0.shape}")
    rate = np.broadcast_to(rate, q0.shape).ravel()
    way = integrator, step, steps
    return q0, ((q0.ravel(), rate, p0 is not None, z0), copied(t), every, way, conformal_factor)


def _solution(run, request, shape, bodies, watch):
    def solution(record):
        return SparseSolution(run, request, shape, record, bodies)

    record = watch.run(lambda watched: run(request, watched), solution)
    sol = solution(record)
    if record.interrupted is not None:
        if isinstance(record.interrupted, KeyboardInterrupt):
            raise Interrupted(sol)
        raise record.interrupted
    return sol
