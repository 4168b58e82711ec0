"""Scene files, as the program `herglotz` runs them."""

import csv
import re
from pathlib import Path

import numpy as np

from . import _core
from ._additions import table
from ._body import body
from ._events import Event
from ._path import path
from ._solve import CATALOGUE, solve
from ._sparse import _MOST_OF_FORMULA, bodies, lattice
from ._system import system

# The tables of a scene with their keys; those of `sweep` and `fit` are for other commands of the program.
_KEYS = {
    "system": "catalogue coordinates lagrangian hamiltonian momenta action constraints lattice bodies body parameters",
    "run": "time accuracy integrator step steps project exact scales breaks",
    "want": "rows events wrap conformal_factor estimate",
}
# Those of tables of the system.
_KEYS_OF_SYSTEM = {
    "lattice": "sites boundary site bond",
    "bodies": "masses dimensions",
    "body": "inertia mass centre gravity gamma torque",
}
# What does not apply to a rigid body and to a path.
_NOT_OF_BODIES = {
    "": "ends force friction tables fit",
    "system": "catalogue coordinates lagrangian hamiltonian momenta action constraints lattice bodies parameters",
    "run": "project exact scales breaks",
    "want": "wrap conformal_factor estimate",
}
_NOT_OF_PATHS = {
    "": "friction tables sweep fit",
    "system": "body",
    "run": "time accuracy step project exact scales breaks",
    "want": "rows events wrap conformal_factor estimate",
}
# The version of scene files, and the tables of version 1 that are tables of the system now.
_VERSION = 2
_MOVED = ("lattice", "body")
_OF_ROWS = "every at every_step columns"
_OF_EVENT = "when direction terminal from columns then impact rest"
_TABLES = {*_KEYS, "version", "start", "ends", "force", "friction", "tables", "sweep", "fit"}


def run(scene, changes=None, *, progress=False, callback=None, callback_interval=1.0):
    """The motion of a scene file, with the numbers of ``herglotz run``.

    Parameters
    ----------
    scene : str or path
        A file in the format of the program, as in the folder scenes of the repository.
    changes : dict, optional
        Other values, as by ``--set``: ``{"gamma": -0.2, "start.x": 1.0, "run.time": 10.0}``.
    progress, callback, callback_interval
        As in `solve`.

    Returns
    -------
    Solution, SparseSolution, RigidBodySolution or Path
        Its first row is the start. Columns of rows that are expressions are ``sol["name"]``, by their name or their text. The
        `columns` and `from` of events are those of the program alone.

    Raises
    ------
    ValueError
        For an invalid scene.

    Examples
    --------
    >>> import herglotz as hz
    >>> from pathlib import Path
    >>> _ = Path("pendulum.toml").write_text('''
    ... system = { coordinates = ["theta"], lagrangian = "theta'^2/2 + cos(theta) + gamma*z", parameters = { gamma = -0.1 } }
    ... start = { theta = 1.0, "theta'" = 0.0 }
    ... run = { time = 10.0, accuracy = 1e-9 }''')
    >>> hz.run("pendulum.toml", {"gamma": 0.0}).status
    'completed'
    """
    try:
        import tomllib
    except ImportError:
        raise ImportError("scene files are read by `tomllib`, which Python has from version 3.11") from None
    try:
        data = tomllib.loads(Path(scene).read_text(encoding="utf-8"))
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{scene}: {error}") from None
    _check(data)
    for name, value in (changes or {}).items():
        _change(data, name, value)
    watch = dict(progress=progress, callback=callback, callback_interval=callback_interval)
    if "ends" in data:
        return _of_ends(data)
    if "body" in data["system"]:
        return _of_body(data, watch)
    return _of_system(data, Path(scene).parent, watch)


def _check(data):
    """Refuses tables and keys that a scene has not."""
    version = data.get("version", _VERSION)
    if version not in range(1, _VERSION + 1):
        raise ValueError(f"the scene has version {version}; this package reads scenes up to version {_VERSION}")
    for name in data:
        if name in _MOVED:
            raise ValueError(f"[{name}] is [system.{name}] from version {_VERSION} of scene files on; the program translates a file by `herglotz migrate`")
        if name not in _TABLES:
            raise ValueError(f"unknown table `{name}`; a scene has {', '.join(sorted(_TABLES))}")
    want, of = data.get("want", {}), data.get("system", {})
    parts = [(f"[{name}]", keys, data.get(name, {})) for name, keys in _KEYS.items()]
    parts += [(f"[system.{name}]", keys, of.get(name, {})) for name, keys in _KEYS_OF_SYSTEM.items()]
    parts += [("`rows`", _OF_ROWS, want.get("rows", {})), *(("an event", _OF_EVENT, event) for event in want.get("events", []))]
    for name, keys, found in parts:
        for key in found:
            if key not in keys.split():
                raise ValueError(f"unknown name `{key}` in {name}, which has {', '.join(keys.split())}")
    for name in ("system", "start", "run"):
        if name not in data and not (name == "start" and "catalogue" in of):
            raise ValueError(f"the scene has no [{name}]")
    kind, others = ("a path between two ends", _NOT_OF_PATHS) if "ends" in data else ("a rigid body", _NOT_OF_BODIES)
    if "ends" not in data and "body" not in of:
        kind, others = "a motion", {}
    for table, keys in others.items():
        for key in keys.split():
            if (data.get(table, {}) if table else data).get(key):
                raise ValueError(f"`{key}` does not apply to {kind}; remove it")
    if "ends" not in data and "time" not in data["run"]:
        raise ValueError("[run] has no `time`; add it")


def _change(data, name, value):
    part, _, key = name.rpartition(".")
    if part not in ("", "start", "run"):
        raise ValueError(f"unknown name `{name}`; give a parameter, `start.` with a name, or `run.` with a name")
    if part == "run":
        if key not in ("time", "accuracy", "integrator", "step", "steps"):
            raise ValueError(f"unknown name `{name}`; the values of the run are time, accuracy, integrator, step and steps")
        # An accuracy and steps exclude each other.
        for other in {"accuracy": ("step", "steps"), "step": ("accuracy", "steps"), "steps": ("accuracy", "step")}.get(key, ()):
            data["run"].pop(other, None)
    if part:
        data.setdefault(part, {})[key] = value
        return
    of = data["system"]
    parameters = of["body"] if "body" in of else of.setdefault("parameters", {})
    known = [*(_KEYS_OF_SYSTEM["body"].split() if "body" in of else parameters)]
    if "catalogue" in of:
        known += [name for name, _ in CATALOGUE.get(of["catalogue"], [()] * 5)[4]]
    if "bodies" in of:
        known += ["G", "gamma", *(f"m_{i}" for i in range(len(of["bodies"]["masses"])))]
    if key not in known:
        raise ValueError(f"unknown name `{key}`; the parameters are {', '.join(known)}")
    parameters[key] = value


def _way(run):
    return {name: run[name] for name in ("accuracy", "integrator", "step", "steps") if name in run}


def _times(data, start):
    """The times of the rows, with that of the start, or the number of steps between them."""
    end, rows = data["run"]["time"], data.get("want", {}).get("rows", {})
    if "every_step" in rows:
        return dict(t=[start, end], every=rows["every_step"])
    if "at" in rows:
        times = list(rows["at"])
        times = times if times[0] == start else [start, *times]
        return dict(t=times if times[-1] == end else [*times, end])
    if "every" in rows:
        count = int(abs(end - start) / rows["every"] * (1 + 4 * np.finfo(float).eps))
        times = start + np.arange(count + 1) * np.copysign(rows["every"], end - start)
        times = np.clip(times, min(start, end), max(start, end)).tolist()
        return dict(t=times if times[-1] == end else [*times, end])
    return dict(t=[start + (end - start) * (k / 1000) if k < 1000 else end for k in range(1001)])


def _system_of(data, tables=None):
    """The system of a scene, and the parameters that events and columns have in addition."""
    given, more = dict(data["system"]), {}
    parameters = dict(given.get("parameters", {}))
    if "lattice" in given:
        of = dict(given["lattice"])
        used = {name: x for name, x in parameters.items() if re.search(rf"\b{re.escape(name)}\b", of["site"] + " " + of.get("bond", ""))}
        more = {name: x for name, x in parameters.items() if name not in used}
        L = lattice(**of, coordinates=given.get("coordinates", ["x"]), parameters=used)
    elif "bodies" in given:
        of = dict(given["bodies"])
        masses = [parameters.pop(f"m_{i}", m) for i, m in enumerate(of["masses"])]
        own = {name: parameters.pop(name) for name in ("G", "gamma") if name in parameters}
        L, more = bodies(masses, dimensions=of["dimensions"], **own), parameters
    else:
        names = {"lagrangian": "L", "catalogue": "L", "hamiltonian": "H"}
        found = {names.get(name, name): x for name, x in given.items()}
        if "L" not in found and "H" not in found:
            raise ValueError("the system has neither a `lagrangian` nor a `hamiltonian`, `catalogue`, `lattice` or `bodies`")
        L = system(**found, tables=tables)
    return L, more


def _start_of(start, L, given):
    """The arguments of `solve` for a start."""
    if "lattice" in given:
        return _start_of_lattice(start, given)
    of = L if isinstance(L, _core.System) else L.system
    names = of.coordinates
    kinds = {
        "q0": names,
        "v0": _core.velocity_names(of.given_coordinates)[1],
        "p0": _core.momentum_names(of.given_coordinates, of.kind[1]),
    }
    values = {kind: [None] * len(names) for kind in kinds}
    others = {"t": 0.0, of.kind[2]: 0.0}
    for name, value in start.items():
        if name in others:
            others[name] = value
            continue
        for kind, all_names in kinds.items():
            # An array has a list, or one number for all its entries.
            places = [i for i, other in enumerate(all_names) if other == name or other.partition("[")[0] == name and "[" in other]
            if places:
                if isinstance(value, str):
                    value = _profile(value, (len(places),), given.get("parameters", {})).tolist()
                for i, x in zip(places, value if isinstance(value, list) else [value] * len(places), strict=True):
                    values[kind][i] = float(x)
                break
        else:
            raise ValueError(f"unknown name `{name}` in [start]; the coordinates are {', '.join(names)}")
    entry = CATALOGUE.get(given.get("catalogue"))
    if entry is not None:
        values["q0"] = [x if x is not None else default for x, default in zip(values["q0"], entry[5])]
        if values["p0"] == [None] * len(names):
            values["v0"] = [x if x is not None else default for x, default in zip(values["v0"], entry[6])]
    chosen = {kind: x for kind, x in values.items() if kind == "q0" or any(e is not None for e in x)}
    for kind, x in chosen.items():
        if None in x:
            raise ValueError(f"[start] has no `{kinds[kind][x.index(None)]}`; add it")
    return others["t"], chosen | {"z0": others[of.kind[2]]}


def _of_system(data, folder, watch):
    tables = {name: _table(name, of, folder) for name, of in data.get("tables", {}).items()}
    L, more = _system_of(data, tables)
    run, want = data["run"], data.get("want", {})
    additions = {"tables": tables} if tables and not isinstance(L, _core.System) else {}
    force = dict(data.get("force", {}))
    if "rayleigh" in force:
        additions["rayleigh"] = force.pop("rayleigh")
    if force:
        additions["force"] = force
    t0, start = _start_of(data.get("start", {}), L, data["system"])
    known = {"t", *_names(L)}
    columns = want.get("rows", {}).get("columns", [])
    if "lattice" in data["system"] and L.dimension > _MOST_OF_FORMULA:
        # The rows of many sites are the whole state.
        known |= {text for text in columns if _is_of_sites(text.strip(), data["system"])}
    observe = {_name(text): text for text in columns if _name(text) not in known}
    conformal = want.get("conformal_factor", False) or any(re.search(r"\b(sigma|log_factor)\b", text) for text in columns)
    return solve(
        L,
        **start,
        **_times(data, t0),
        **_way(run),
        **{name: run[name] for name in ("project", "exact", "scales", "breaks") if name in run},
        **additions,
        events=[_event(event) for event in want.get("events", [])] or (),
        observe=observe or None,
        conformal_factor=conformal,
        estimate=want.get("estimate", False),
        friction=data.get("friction"),
        parameters=more or None,
        **watch,
    )


def _name(column):
    """The name of a column, which its value may have, or its text."""
    named = re.match(r"\s*(\w+)\s*=", re.split(r"[;\n]", column.strip())[-1])
    return named[1] if named else column


def _names(L):
    """The columns that a solution has by itself."""
    if not isinstance(L, _core.System) and L.dimension > _MOST_OF_FORMULA:
        return []
    of = L if isinstance(L, _core.System) else L.system
    return [*of.coordinates, *_core.velocity_names(of.given_coordinates)[1]]


def _is_of_sites(column, given):
    """Whether a column is one of a lattice of many sites."""
    names, index = given.get("coordinates", ["x"]), re.search(r"(\d+)\]?'?$", column)
    if index is None or int(index[1]) >= np.prod(given["lattice"]["sites"]):
        return column in ("z", "energy", "log_factor")
    forms = ["{}[{}]", "{}'[{}]", "p_{}[{}]"] if len(names) == 1 else ["{}_{}", "{}_{}'", "p_{}_{}"]
    return any(form.format(name, int(index[1])) == column for form in forms for name in names)


def _event(given):
    impact = given.get("impact")
    if isinstance(impact, dict):
        impact = next(iter(impact.items()))
    direction, terminal = given.get("direction", "both"), given.get("terminal", False)
    return Event(given["when"], direction, terminal, reset=given.get("then"), impact=impact, rest=given.get("rest"))


def _table(name, of, folder):
    pieces = of.get("pieces", "linear")
    if "csv" not in of:
        return table(of["times"], of["values"], pieces)
    with open(folder / of["csv"], newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if line.strip() and not line.startswith("#")))
    return table(*([float(row[key]) for row in rows] for key in (of.get("time", "t"), of.get("value", name))), pieces)


def _of_ends(data):
    L, _ = _system_of(data)
    t0, start = _start_of(data.get("start", {}), L, data["system"])
    ends = dict(data["ends"])
    t1 = ends.pop("t")
    _, end = _start_of(ends, L, {name: x for name, x in data["system"].items() if name != "catalogue"})
    force = dict(data.get("force", {}))
    rayleigh = force.pop("rayleigh", None)
    run = {name: data["run"][name] for name in ("steps", "integrator") if name in data["run"]}
    return path(L, start["q0"], end["q0"], (t0, t1), z0=start["z0"], force=force or None, rayleigh=rayleigh, **run)


def _of_body(data, watch):
    start = dict(data["start"])
    t0 = start.pop("t", 0.0)
    given = dict(q0=start.get("attitude"), v0=start["omega"], z0=start.get("z", 0.0))
    events = [Event(event["when"], event.get("direction", "both"), event.get("terminal", False)) for event in data.get("want", {}).get("events", [])]
    return solve(body(**data["system"]["body"]), **given, **_times(data, t0), **_way(data["run"]), events=events, **watch)


def _start_of_lattice(start, given):
    """The same for a lattice: components of all sites, or numbers at single sites. Velocities are 0 where they are not given."""
    names, sizes = given.get("coordinates", ["x"]), tuple(np.atleast_1d(given["lattice"]["sites"]))
    sites, several = int(np.prod(sizes)), len(names) > 1
    kinds = {"q0": names, "v0": _core.velocity_names(names)[1], "p0": [f"p_{name}" for name in names]}
    values = {kind: np.full((sites, len(names)), np.nan) for kind in kinds}
    others = {"t": 0.0, "z": 0.0}
    for name, value in start.items():
        if name in others:
            others[name] = value
            continue
        for kind, components in kinds.items():
            if name in components:
                values[kind][:, components.index(name)] = np.ravel(_profile(value, sizes, given.get("parameters", {})))
                break
            # As in `x[3]`, `x'[3]`, or with several components `x_3` and `x_3'`.
            found = re.fullmatch(r"(\w+)_(\d+)('?)" if several else r"(\w+'?)\[(\d+)\]()", name)
            if found and found[1] + found[3] in components and int(found[2]) < sites:
                values[kind][int(found[2]), components.index(found[1] + found[3])] = value
                break
        else:
            raise ValueError(f"unknown name `{name}` in [start]; the coordinates at a site are {', '.join(names)}")
    if np.isnan(values["p0"]).all():
        values["v0"] = np.nan_to_num(values["v0"])
    chosen = {kind: x.ravel() for kind, x in values.items() if kind == "q0" or not np.isnan(x).all()}
    for kind, x in chosen.items():
        if np.isnan(x).any():
            raise ValueError(f"[start] has no `{kinds[kind][np.flatnonzero(np.isnan(x))[0] % len(names)]}` at some sites; add it")
    return others["t"], chosen | {"z0": others["z"]}


def _profile(of, sizes, parameters):
    """The values at all sites: of a number, of a list, or of a formula in the indices i, j, k and the number n of sites."""
    if not isinstance(of, str):
        return np.broadcast_to(np.reshape(of, sizes) if isinstance(of, list) else float(of), sizes)
    names = "ijk"[: len(sizes)]
    *definitions, value = re.split(r"[;\n]", of.strip().rstrip(";"))
    # Where all velocities are 0 the value of this Lagrangian is that of the formula.
    text = "; ".join([*definitions, " + ".join([*(f"{name}'^2/2" for name in names), f"({value})"])])
    known = {name: x for name, x in parameters.items() if name not in names}
    formula = system(text, coordinates=list(names), parameters={"n": float(np.prod(sizes))} | known)
    at = lambda index: _core.geometry(formula, (0.0, [*map(float, index)], [0.0] * len(names), 0.0))["lagrangian"]
    return np.array([at(index) for index in np.ndindex(*sizes)]).reshape(sizes)
