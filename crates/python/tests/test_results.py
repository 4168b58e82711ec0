"""Tables and pictures of the results of every kind."""

import herglotz as hz
import numpy as np
import pytest

pytest.importorskip("pandas"), pytest.importorskip("xarray")
pyplot = pytest.importorskip("matplotlib.pyplot")
pyplot.switch_backend("Agg")

T = np.linspace(0.0, 2.0, 5)
ROWS = {
    "lagrangian": lambda: hz.solve("(x'^2 + y'^2)/2 - x^2 - y^2/2 - z/10", [1.0, 0.5], [0.0, 1.0], T, coordinates=["x", "y"]),
    "hamiltonian": lambda: hz.solve(H="p_x^2/2 + x^2/2 + z/10", q0=[1.0], p0=[0.0], t=T, coordinates=["x"]),
    "rigid body": lambda: hz.rigid_body((1, 2, 3), omega=(1, 0.5, 0.25), gamma=-0.1, t=T),
    "line of sites": lambda: hz.lattice("x'^2/2 + cos(x)", "-(xr - xl)^2/2", [0.0, 1.0, 0.5], 0.0, T, step=0.1),
    "plane of sites": lambda: hz.lattice("x'^2/2 + cos(x)", "-(xr - xl)^2/2", np.eye(3), 0.0, T, step=0.1),
    "bodies": lambda: hz.bodies([1.0, 0.1], [[0, 0], [1, 0]], [[0, 0], [0, 1]], T, step=0.1),
    "path": lambda: hz.path("x'^2/2 + cos(x) - z/10", [0.0], [1.0], 2.0, steps=4, coordinates=["x"]),
}
# A column by its name, and the same by its place in an array.
SOME = {
    "lagrangian": ("y'", lambda sol: sol.v[:, 1]),
    "hamiltonian": ("x", lambda sol: sol.q[:, 0]),
    "rigid body": ("Pi2", lambda sol: sol.Pi[:, 1]),
    "line of sites": ("v[2]", lambda sol: sol.v[:, 2]),
    "plane of sites": ("p[2, 1]", lambda sol: sol.p[:, 2, 1]),
    "bodies": ("q[1, 0]", lambda sol: sol.q[:, 1, 0]),
    "path": ("p_x", lambda sol: sol.p[:, 0]),
}


@pytest.fixture(autouse=True)
def own_figure():
    pyplot.close("all")
    yield
    pyplot.close("all")


@pytest.mark.parametrize("kind", ROWS)
def test_rows_are_tables_and_pictures(kind, tmp_path):
    sol, (name, column) = ROWS[kind](), SOME[kind]
    assert np.array_equal(sol[name], column(sol)) and np.array_equal(sol["t"], sol.t)
    frame = sol.to_pandas()
    assert np.array_equal(frame[name], column(sol)) and np.array_equal(frame.index, sol.t) and frame.index.name == "t"
    data = sol.to_xarray()
    assert np.array_equal(data["t"], sol.t) and np.array_equal(data["z"], sol.z)
    for array in data.data_vars.values():
        assert array.dims[0] == "t" and np.isfinite(array).all()
    with pytest.raises(KeyError, match="there is no column .*w"):
        sol["w"]
    first = sol.plot()
    assert first.lines or first.collections
    first.figure.savefig(tmp_path / "plot.png")
    pyplot.close("all")
    (line,) = sol.plot(name).lines
    assert np.array_equal(line.get_ydata(), column(sol))


@pytest.mark.parametrize("t", [2.0, T])
def test_ensembles_are_tables_and_pictures(t, tmp_path):
    found = hz.ensemble("x'^2/2 - x^2/2 - z/10", [[1.0], [0.5], [0.0]], np.zeros((3, 1)), t, coordinates=["x"], observe={"square": "x^2"})
    many = np.ndim(t) > 0
    frame, data = found.to_pandas(), found.to_xarray()
    assert np.array_equal(frame["x'"], found.v.ravel()) and np.array_equal(frame["square"], found["square"].ravel())
    assert list(frame.index.names) == (["member", "t"] if many else ["member"])
    if many:
        assert frame.loc[(1, T[3]), "x"] == found.q[1, 3, 0] and np.array_equal(data["t"], T)
    else:
        assert np.array_equal(frame["t"], found.t) and np.array_equal(data["reached"], found.t)
    assert np.array_equal(data["q"].sel(coordinate="x"), found["x"]) and data["success"].all()
    with pytest.raises(KeyError, match="add it to `ensemble`"):
        found["w"]
    axes = found.plot("x")
    assert len(axes.lines) == (3 if many else 1) and axes.get_ylabel() == ("x" if many else "x'")
    axes.figure.savefig(tmp_path / "plot.png")


@pytest.mark.parametrize("name", ["q[3]", "q[0, 0]", "q[-1]", "w[0]", "q[]", "q"])
def test_a_column_of_a_site_that_is_not_there(name):
    with pytest.raises(KeyError, match=r"up to \[2\]"):
        ROWS["line of sites"]()[name]


def test_a_coordinate_of_an_ensemble_is_plotted():
    found = hz.ensemble("(x'^2 + y'^2)/2 - x^2", [[1.0, 2.0], [0.5, 3.0]], np.ones((2, 2)), T, coordinates=["x", "y"])
    for axes in (found.plot("y"), found.plot(1, pyplot.figure().gca())):
        assert axes.get_ylabel() == "y" and np.array_equal(axes.lines[1].get_ydata(), found.q[1, :, 1])
