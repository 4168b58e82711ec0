"""Scene files; that their rows are those of the program is checked where both are there, by .ci/scenes_agree."""

from pathlib import Path

import herglotz as hz
import numpy as np
import pytest

pytest.importorskip("tomllib")
SCENES = Path(__file__).parents[3] / "scenes"

PENDULUM = """
[system]
coordinates = ["theta"]
lagrangian = "theta'^2/2 + cos(theta) + gamma*z"
parameters = { gamma = -0.1 }
[start]
theta = 1.0
"theta'" = 0.0
[run]
time = 10.0
accuracy = 1e-10
[want]
rows = { every = 0.5, columns = ["t", "theta", "twice = 2*theta", "sigma"] }
events = [{ when = "theta", direction = "rising" }]
"""


def written(folder, text):
    file = folder / "scene.toml"
    file.write_text(text)
    return file


def test_a_scene_is_the_call_of_solve(tmp_path):
    sol = hz.run(written(tmp_path, PENDULUM), {"gamma": -0.2, "start.theta": 0.5, "run.time": 5.0})
    expected = hz.solve("theta'^2/2 + cos(theta) + gamma*z", [0.5], [0.0], np.arange(11) / 2, coordinates=["theta"],
                        parameters={"gamma": -0.2}, accuracy=1e-10, events=hz.Event("theta", "rising"))  # fmt: skip
    assert (sol["theta"] == expected["theta"]).all() and (sol["twice"] == 2 * sol["theta"]).all()
    assert (sol.events[0].t == expected.events[0].t).all() and abs(sol["sigma"] - np.exp(-0.2 * sol.t)).max() < 1e-14
    # Everything of a solution is there.
    assert sol.resume(6.0).success and sol.sensitivity("gamma").q.shape == (11, 1)


@pytest.mark.parametrize("scene", sorted(SCENES.glob("*.toml")), ids=lambda scene: scene.stem)
def test_every_scene_of_the_repository_runs(scene):
    sol = hz.run(scene)
    assert sol.found if isinstance(sol, hz.Path) else sol.success


LATTICE = """
[system]
parameters = { k = 2.0, gamma = -0.1 }
[system.lattice]
sites = [2, 10]
boundary = "fixed"
site = "x'^2/2 + cos(x) + gamma*z"
bond = "-k*(xr - xl)^2/2"
[start]
x = "sin(i + j/n) + k"
"x[3]" = 0.5
[run]
time = 1.0
integrator = "strang"
step = 0.1
"""


def test_lattices_run_by_sparse_integrators_or_as_formulas(tmp_path):
    i, j = np.indices((2, 10))
    q0 = (np.sin(i + j / 20) + 2).ravel()
    q0[3] = 0.5
    L = hz.lattice("x'^2/2 + cos(x) + gamma*z", "-k*(xr - xl)^2/2", sites=(2, 10), boundary="fixed", parameters={"k": 2.0, "gamma": -0.1})
    sparse = hz.run(written(tmp_path, LATTICE))
    assert isinstance(sparse, hz.SparseSolution) and (sparse.q[-1] == hz.solve(L, q0, np.zeros(20), 1.0, integrator="strang", step=0.1).q[-1]).all()
    for change in [("strang", "gauss_4"), ('integrator = "strang"\nstep = 0.1', "accuracy = 1e-8")]:
        sol = hz.run(written(tmp_path, LATTICE.replace(*change)))
        # A method of order 2 with ten steps against more accurate ones.
        assert isinstance(sol, hz.Solution) and abs(sol.q[-1] - sparse.q[-1]).max() < 0.02
    with pytest.raises(ValueError, match=r"unknown name `x\[20\]` in \[start\]"):
        hz.run(written(tmp_path, LATTICE.replace("x[3]", "x[20]")))
    with pytest.raises(ValueError, match=r"\[start\] has no `x` at some sites"):
        hz.run(written(tmp_path, LATTICE.replace('x = "sin(i + j/n) + k"\n', "")))


def test_columns_of_many_sites_are_those_of_the_state(tmp_path):
    def with_columns(names):
        return written(tmp_path, LATTICE.replace("[2, 10]", "[2, 150]") + f"[want]\nrows = {{ every = 0.5, columns = {names} }}\n")

    sol = hz.run(with_columns(["t", "x[299]", "x'[0]", "p_x[7]", "energy", "log_factor"]))
    # gamma = -0.1.
    assert sol["q[299]"].shape == (3,) and np.allclose(sol["log_factor"], -0.1 * sol["t"], rtol=0, atol=1e-14)
    for wrong in ["2*x[0]", "x[300]"]:
        with pytest.raises(ValueError, match="accuracy, events and columns"):
            hz.run(with_columns(["t", wrong]))


def test_bodies_refuse_what_does_not_apply(tmp_path):
    body = (SCENES / "heavy_top.toml").read_text()
    assert hz.run(written(tmp_path, body), {"mass": 14.0}).success
    for table, key in [("[run]", "exact = true"), ("[want]", "estimate = true"), ("[start]", "[force]\nx = '1'\n[start]")]:
        with pytest.raises(ValueError, match="does not apply to a rigid body"):
            hz.run(written(tmp_path, body.replace(table, key if "[" in key else f"{table}\n{key}")))


def test_values_of_the_literature():
    body = hz.run(SCENES / "free_body.toml")
    assert abs(body.Pi[-1] - [0.328817081371932892, -0.494159614067396359, -0.231714161269102468]).max() < 1e-12
    found = hz.run(SCENES / "containers.toml")
    assert abs(found.q[-1, 0] - 1.16581228326) < 1e-9 and abs(found["E1"][-1] - 2.63142893086) < 1e-9


@pytest.mark.parametrize(
    "change, message",
    [
        (("[run]", "[walk]"), "unknown table `walk`"),
        (("time =", "tme ="), r"unknown name `tme` in \[run\]"),
        (("theta = 1.0\n", "phi = 1.0\n"), r"unknown name `phi` in \[start\]"),
        (("theta = 1.0\n", ""), r"\[start\] has no `theta`"),
        (("cos(theta)", "cos(teta)"), "unknown name `teta`"),
        (("direction =", "way ="), "unknown name `way` in an event"),
        (("every =", "each ="), "unknown name `each` in `rows`"),
        (("[system]", "[system"), "scene.toml"),
        (("lagrangian =", "H ="), r"unknown name `H` in \[system\]"),
        (("time = 10.0\n", ""), r"\[run\] has no `time`"),
        (("[system]", "version = 3\n[system]"), "the scene has version 3"),
        (("[system]", "lattice = { sites = 3 }\n[system]"), r"\[lattice\] is \[system.lattice\] from version 2 .* `herglotz migrate`"),
        (("[system]", "body = { inertia = [1, 2, 3] }\n[system]"), r"\[body\] is \[system.body\]"),
        (("[run]", "[ends]\ntheta = 1.0\nt = 2.0\n[run]"), "`time` does not apply to a path between two ends"),
    ],
)
def test_what_is_wrong_with_a_scene_is_said(tmp_path, change, message):
    assert change[0] in PENDULUM
    with pytest.raises(ValueError, match=message):
        hz.run(written(tmp_path, PENDULUM.replace(*change)))


@pytest.mark.parametrize("name", ["start.phi", "run.speed", "gama", "want.rows"])
def test_unknown_changes_are_refused(tmp_path, name):
    with pytest.raises(ValueError, match=name.rpartition(".")[2] if "." not in name else f"unknown name `({name}|phi)`"):
        hz.run(written(tmp_path, PENDULUM), {name: 1.0})
