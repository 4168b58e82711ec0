"""Systems of many coordinates: lattices given by the formulas of a site and of a bond, and gravitating bodies."""

import functools
import re

import numpy as np

from . import _core
from ._rows import Rows, axes_of, times_after
from ._solution import Interrupted, States
from ._system import Composed, copied, is_absent, system_of, warn_of_gain, warn_of_positive
from ._watch import Watch

# Up to this number of coordinates all integrators are those of a formula.
_FEW = 16
# Up to this number, a formula runs by contact Gauss collocation.
_MOST_OF_FORMULA = 256
# The arguments of `solve` that the sparse integrators have.
_OF_RUN = frozenset(
    "L q0 v0 t p0 z0 integrator step steps every conformal_factor progress callback callback_interval".split()
)


class SparseSystem(Composed):
    """A system of many coordinates, as a sum of local terms; made by `lattice` and `bodies` without a start.

    It takes the place of a Lagrangian in `solve` and in all other functions. With given steps, and without events, columns
    and what else takes a formula, `solve` runs it by its sparse integrators where it has more than 16 coordinates. Else it is
    a formula, with everything that formulas have, up to 256 coordinates.

    Attributes
    ----------
    dimension : int
        The number of coordinates.
    shape : tuple of int
        The axes of a position: those of the sites and, if there are several, the components.
    parameters : dict of float
        The parameters with their values; those of bodies are "G", "gamma" and the masses "m_0", "m_1" and so on.
    """

    def __init__(self, what, shape, made, parameters):
        # `made` has the function of the core that runs it, the one that writes its formula, and what both take before the
        # parameters.
        self._what, self.shape, self._made, self.parameters = what, tuple(shape), made, dict(parameters)
        self.dimension = int(np.prod(self.shape))

    @property
    def system(self):
        """The same system as a formula: a `System` of up to 256 coordinates."""
        if self.dimension > _MOST_OF_FORMULA:
            raise ValueError(
                f"a formula has at most {_MOST_OF_FORMULA} coordinates, and the {self._what} has {self.dimension}: it runs by "
                "`solve` with given steps of a splitting, of midpoint, gauss_1 or gauss_2, without accuracy, events and columns"
            )
        text, coordinates, parameters = self._made[1](*self._made[2:], self.parameters)
        return system_of(text, coordinates, parameters)

    def with_parameters(self, parameters):
        """The same system with other values of parameters."""
        unknown = [name for name in parameters or {} if name not in self.parameters]
        if unknown:
            names = ", ".join(map(repr, self.parameters)) or "no parameters"
            raise ValueError(f"the parameter {unknown[0]!r} is not one of the {self._what}: it has {names}")
        return SparseSystem(self._what, self.shape, self._made, self.parameters | dict(parameters or {}))

    def _solve(self, arguments):
        """The motion for the arguments of `solve`."""
        from ._solve import solve

        of, arguments["parameters"] = self._with(arguments["parameters"])
        for name in ("q0", "v0", "p0"):
            if arguments[name] is not None:
                x = _array(name, arguments[name])
                arguments[name] = np.broadcast_to(x, self.dimension) if np.ndim(arguments[name]) == 0 else x.ravel()
        asked = {name: x for name, x in arguments.items() if name in _OF_RUN and name != "L"}
        others = {name for name, x in arguments.items() if name not in _OF_RUN and not is_absent(x)}
        has_steps = isinstance(asked["integrator"], str) and (asked["step"], asked["steps"]) != (None, None)
        # Gauss methods of more stages are those of the formula.
        stages = re.fullmatch(r"gauss_(\d+)", asked["integrator"]) if has_steps else None
        is_formula = stages is not None and int(stages[1]) > 2 and self.dimension <= _MOST_OF_FORMULA
        if self.dimension > _FEW and not others and has_steps and not is_formula:
            watch = Watch(*(asked.pop(name) for name in ("progress", "callback", "callback_interval")))
            return of._solution(**asked, watch=watch)
        return solve(**arguments | {"L": of.system})

    def _solution(self, q0, v0, t, p0, z0, integrator, step, steps, every, conformal_factor, watch):
        """The motion by the sparse integrators; the arguments are those of `solve`."""
        q0, request = _request(q0, v0, p0, z0, t, every, integrator, step, steps, conformal_factor)
        if q0.size != self.dimension:
            raise ValueError(f"`q0` has {q0.size} numbers, but the {self._what} has {self.dimension} coordinates")
        run = functools.partial(self._made[0], *self._made[2:], self.parameters)
        found = _solution(run, request, q0.shape, len(q0.shape) > 1 and self._what == "system of bodies", watch)
        if self._what != "lattice":
            warn_of_positive(self.parameters["gamma"])
        elif "gamma" in self.parameters:
            coordinates, site, _ = self._made[2]
            warn_of_gain(_core.System(site, coordinates, self.parameters), np.zeros(len(coordinates)))
        return found

    def __repr__(self):
        return f"<SparseSystem: a {self._what} of shape {self.shape}>"


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
        times = times_after(asked, at, t)
        if steps is not None:
            # The number of steps was for another span.
            asked = np.atleast_1d(np.asarray(asked, dtype=float))
            step, steps = abs(asked[-1] - (asked[0] if len(asked) > 1 else 0.0)) / steps, None
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
    sites=None,
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
    """A lattice of equal sites with bonds between neighbours, with any number of sites, or its motion.

    With `sites` it is a system for `solve` and for all other functions; with `q0` it is run here, with given steps.

    Its Lagrangian is the sum of `site` over the sites, of `bond` over the pairs of neighbours along each axis, and of
    the drag gamma(t) z. The drag is written in `site`, so that each site satisfies its own Herglotz equation; z is the
    action of the whole lattice, and the term counts once.

    Parameters
    ----------
    site : str
        The Lagrangian of a site, of the form ``m*x'^2/2 - V(t, x) + gamma*z``: ``"x'^2/2 - (1 - cos(x)) + gamma*z"``.
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
    sites : int or tuple of int, optional
        The number of sites along each direction of the lattice, in place of `q0`. In formulas about the whole lattice, as
        those of events, the coordinates are ``x[0]``, ``x[1]`` and so on; with several coordinates at a site ``x_0``,
        ``y_0``, ``x_1``, ...
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
    SparseSystem or SparseSolution

    Raises
    ------
    ValueError
        For an invalid argument.
    Interrupted
        A `KeyboardInterrupt` with the solution up to the interruption.

    Examples
    --------
    Four coupled pendulums, to an accuracy and with an event:

    >>> import herglotz as hz
    >>> chain = hz.lattice("x'^2/2 + cos(x) + gamma*z", "-(xr - xl)^2/2", sites=4, parameters={"gamma": -0.1})
    >>> sol = hz.solve(chain, [0.1, 0.3, 0.0, 0.2], [0.0] * 4, 20.0, events="x[0]")
    >>> len(sol.events[0]) > 2
    True

    A wave in a thousand pendulums coupled by springs:

    >>> import numpy as np, herglotz as hz
    >>> x = np.arange(1000)
    >>> sol = hz.lattice("x'^2/2 - (1 - cos(x)) + gamma*z", "-(xr - xl)^2/2", 3*np.exp(-(x - 500)**2/100), 0.0,
    ...                  np.linspace(0, 50, 101), step=0.05, parameters={"gamma": -0.01})
    >>> sol.q.shape
    (101, 1000)
    """
    coordinates = [coordinates] if isinstance(coordinates, str) else list(coordinates)
    for name, of, example in (("site", site, "x'^2/2 - (1 - cos(x)) + gamma*z"), ("bond", bond, "-k*(xr - xl)^2/2")):
        if not isinstance(of, str) and (name == "site" or of is not None):
            raise TypeError(
                f"`{name}` is {of!r}; a lattice is written by formulas, as in {name}=\"{example}\", and takes no functions: "
                "functions are for `solve`"
            )
    _one_of("sites", sites, q0)
    if q0 is not None:
        sizes = np.shape(_array("q0", q0))
        if len(coordinates) > 1:
            if sizes[-1:] != (len(coordinates),):
                raise ValueError(f"`q0` has the shape {sizes}; its last axis must have the {len(coordinates)} coordinates of a site")
            sizes = sizes[:-1]
    else:
        sizes = tuple(int(size) for size in np.atleast_1d(sites))
    shape = sizes if len(coordinates) == 1 else (*sizes, len(coordinates))
    made = _run_lattice, _core.lattice_terms, (coordinates, site, bond), sizes, boundary
    system = SparseSystem("lattice", shape, made, parameters or {})
    if q0 is None:
        _no_motion(v0=v0, t=t, p0=p0, step=step, steps=steps, every=every)
        return system
    watch = Watch(progress, callback, callback_interval)
    return system._solution(q0, v0, t, p0, z0, integrator, step, steps, every, conformal_factor, watch)


def bodies(
    masses,
    q0=None,
    v0=None,
    t=None,
    *,
    p0=None,
    dimensions=None,
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
    """Any number of bodies with Newtonian gravitation of each pair and linear drag, or their motion.

    L = sum m_i |v_i|^2/2 + sum_(i<j) G m_i m_j/|q_i - q_j| + gamma z. With `dimensions` it is a system for `solve`, which
    chooses the steps for an accuracy, and for all other functions; with `q0` it is run here, by steps of one length, which
    must resolve the closest encounter.

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
    dimensions : {2, 3}, optional
        The plane or space, in place of `q0`. In formulas the coordinates are ``x_0``, ``y_0``, ``x_1`` and so on.
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
    SparseSystem or SparseSolution

    Raises
    ------
    ValueError
        For an invalid argument.
    Interrupted
        A `KeyboardInterrupt` with the solution up to the interruption.
    """
    masses = _array("masses", masses)
    _one_of("dimensions", dimensions, q0)
    if q0 is not None:
        shape = np.shape(_array("q0", q0))
        if len(shape) != 2 or shape[0] != len(masses):
            raise ValueError(f"`q0` has the shape {shape}; it must have a row for each of the {len(masses)} bodies")
        dimensions = shape[1]
    given = {f"m_{i}": m for i, m in enumerate(masses)} | {"G": G, "gamma": gamma}
    made = _run_bodies, _bodies_terms, len(masses), dimensions
    system = SparseSystem("system of bodies", (len(masses), dimensions), made, given)
    if q0 is None:
        _no_motion(v0=v0, t=t, p0=p0, step=step, steps=steps, every=every)
        return system
    watch = Watch(progress, callback, callback_interval)
    return system._solution(q0, v0, t, p0, z0, integrator, step, steps, every, conformal_factor, watch)


def _one_of(name, x, q0):
    """Refuses a system that is neither for `solve` nor for a motion here, or both."""
    if (x is None) == (q0 is None):
        which = "`q0` is not given" if q0 is None else f"`q0` and `{name}` are both given"
        raise ValueError(f"{which}: give `q0` for a motion here, or `{name}` for a system that `solve` runs")


def _no_motion(**given):
    """Refuses arguments of a motion beside a system without a start."""
    for name, x in given.items():
        if x is not None:
            raise ValueError(f"`{name}` is given without `q0`: give it to `solve`, as in hz.solve(system, q0, v0, t)")


# These functions are defined in the module so that a solution can be pickled.
def _run_lattice(*arguments):
    return _core.run_lattice(*arguments)


def _of_bodies(count, dimensions, parameters):
    return [parameters[f"m_{i}"] for i in range(count)], dimensions, parameters["G"], parameters["gamma"]


def _run_bodies(count, dimensions, parameters, *request):
    return _core.run_bodies(*_of_bodies(count, dimensions, parameters), *request)


def _bodies_terms(count, dimensions, parameters):
    return _core.bodies_terms(*_of_bodies(count, dimensions, parameters))


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
