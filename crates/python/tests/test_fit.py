"""Fits of motions to data."""

import herglotz as hz
import numpy as np
import pytest

L = "x'^2/2 - k*x^2/2 + gamma*z"
GUESS = dict(coordinates=["x"], parameters={"k": 0.9, "gamma": -0.09})
T = np.linspace(0.0, 40.0, 101)


def position(t, k=1.0, gamma=-0.1):
    w = np.sqrt(k - gamma**2 / 4)
    return np.exp(gamma * t / 2) * (np.cos(w * t) - gamma / (2 * w) * np.sin(w * t))


def spring(data, unknowns=("k", "gamma"), t=T, q0=1.0, v0=0.0, **more):
    unknowns = unknowns if isinstance(unknowns, str) else list(unknowns)
    return hz.fit(L, [q0], [v0], t, data, unknowns, **GUESS | more)


def test_the_damped_spring_of_the_book_of_diffsol():
    found = spring({"x": position(T)}, accuracy=1e-12)
    assert found.success and found.iterations <= 10, found
    # The accuracy of the motion, where the derivative of its end is of order one.
    assert abs(found["k"] - 1) < 1e-11 and abs(found["gamma"] + 0.1) < 1e-11, found
    assert found.system.parameters == {"k": found["k"], "gamma": found["gamma"]}
    assert np.abs(found.residuals["x"]).max() < 1e-10 and found.jacobian.shape == (101, 2)
    again = hz.solve(found.system, found.q0, found.v0, T, integrator="gauss_8", step=found.step)
    assert np.abs(again.q[:, 0] - found.fitted["x"]).max() < 1e-13


def test_noise_missing_data_sigma_and_the_start():
    # Data are missing at some times, and velocities have another deviation.
    draw = np.random.default_rng(7)
    x = position(T) + 0.02 * draw.standard_normal(101)
    exact = hz.solve(L, [1.0], [0.0], T, coordinates=["x"], parameters={"k": 1.0, "gamma": -0.1})
    v = exact.v[:, 0] + 0.05 * draw.standard_normal(101)
    x[::7] = np.nan
    found = spring({"x": x, "w = x'": v}, ("k", "gamma", "x", "x'"), sigma={"x": 0.02, "w = x'": 0.05}, q0=0.9)
    assert found.success and found.names == ("k", "gamma", "x", "x'")
    assert len(found.t["x"]) == 86 and len(found.residuals["w = x'"]) == 101
    # Four standard errors are exceeded once in 4000 fits.
    for name, truth in {"k": 1.0, "gamma": -0.1, "x": 1.0, "x'": 0.0}.items():
        assert abs(found[name] - truth) < 4 * found.error(name) < 0.1, found
    # The relative standard deviation of a variance of 183 degrees of freedom is 10 %.
    assert abs(found.residual_variance - 1) < 0.4, found
    error = np.sqrt(np.diag(found.covariance))
    np.testing.assert_allclose(error, found.errors, rtol=1e-14)
    np.testing.assert_allclose(found.covariance / np.outer(error, error), found.correlation, atol=1e-14)
    assert found.q0[0] == found["x"] and found.v0[0] == found["x'"] and found.p0 is None
    table = str(found)
    assert table.startswith("converged") and "k " in table and "+-" in table and "correlation of" in table, table


def test_a_robust_loss_ignores_outliers():
    x = position(T)
    x[50] += 3.0
    plain, robust = spring({"x": x}), spring({"x": x}, sigma=0.01, loss=("cauchy", 3.0))
    assert abs(plain["k"] - 1) > 100 * abs(robust["k"] - 1) and abs(robust["k"] - 1) < 1e-4


def test_bounds_starts_and_nodes():
    data = {"x": position(T)}
    held = spring(data, bounds={"gamma": (-0.05, 0.0)}, parameters={"k": 0.9, "gamma": -0.01})
    assert held.at_bounds == {"gamma": "lower"} and held["gamma"] == -0.05 and np.isnan(held.error("gamma"))
    # From a wrong frequency: the best of several starts, and pieces of the motion.
    wrong = dict(parameters={"k": 2.5, "gamma": -0.1})
    several = spring(data, starts=[{"k": 1.2}, {"k": 1.05}], **wrong)
    assert len(several.costs) == 2 and several.costs[several.best_start] == several.costs.min() and abs(several["k"] - 1) < 1e-8
    one = spring(data, parameters={"k": 1.05, "gamma": -0.1})
    shooting = spring(data, nodes=np.arange(2.0, 40.0, 2.0), **wrong)
    assert abs(shooting["k"] - 1) < 1e-8 and shooting.largest_defect < 1e-8 and one.largest_defect is None


def test_a_start_by_momentum():
    x = position(T)
    found = hz.fit(L, [1.0], None, T, {"x": x}, ["p_x"], p0=[0.3], coordinates=["x"], parameters={"k": 1.0, "gamma": -0.1})
    assert abs(found["p_x"]) < 1e-8 and found.v0 is None and found.p0[0] == found["p_x"]


def test_what_the_data_do_not_determine_is_named():
    formula = "m*x'^2/2 - k*x^2/2"
    given = dict(coordinates=["x"], parameters={"m": 1.0, "k": 1.1})
    found = hz.fit(formula, [1.0], [0.0], T[:30], {"x": np.cos(T[:30])}, ["m", "k"], **given)
    assert not found.success and found.covariance is None and np.isnan(found.errors).all()
    assert "rank 1 of 2" in found.status and "`m` : `k` = 1.0000" in found.status, found.status
    with pytest.raises(ValueError, match="1 measured values cannot determine 2 parameters: the Jacobian has rank 1 of 2"):
        spring({"x": [0.5]}, t=[1.0], t0=0.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(unknowns=["gama"]), "there is no variable `gama`; did you mean `gamma`"),
        (dict(unknowns="k"), "`unknowns` is 'k'; it must be a list of names"),
        (dict(unknowns=["t_end"]), "t_end cannot be an unknown of a fit"),
        (dict(unknowns=["p_x"]), "the start, which is given by velocities"),
        (dict(data={}), "`data` is {}; it must give values by name"),
        (dict(data={"y": position(T)}), "unknown name `y`"),
        (dict(data={"x": [1.0]}), r"data\['x'\] has 1 values, but `t` has 101"),
        (dict(data={"x": np.full(101, np.inf)}), r"data\['x'\] is infinite"),
        (dict(data={"x": np.full(101, np.nan)}), "no value was observed after the start"),
        (dict(t0=1.0), "the time 0 is 0; times must be finite and not before the start t0 = 1"),
        (dict(t0=50.0), "the last of the data is at t = 40.0, but the motion starts at 50.0"),
        (dict(sigma=0.0), "the sigma of 'x' must be positive"),
        (dict(sigma={"y": 1.0}), "`sigma` has 'y', of which there are no data"),
        (dict(bounds={"kk": (0, 1)}), "`bounds` has 'kk', which is no unknown; the unknowns are k, gamma"),
        (dict(bounds={"k": (2, 1)}), "the bounds of `k` are 2 and 1"),
        (dict(bounds={"k": (2, 3)}), "the start of `k` is 0.9; it must be finite and between 2 and 3"),
        (dict(loss="huber"), "`loss` is 'huber'; it must be one of 'huber'"),
        (dict(loss=("huber", -1.0)), "the scale of the loss is -1; it must be positive"),
        (dict(nodes=[50.0]), "the node 0 is at 50; nodes must ascend strictly"),
        (dict(starts=[{"m": 1.0}]), "`starts` has 'm', which is no unknown"),
    ],
)
def test_invalid_fits_are_refused(change, message):
    given = dict(data={"x": position(T)}) | change
    with pytest.raises(ValueError, match=message):
        spring(**given)


def test_residuals_are_plotted():
    figure = pytest.importorskip("matplotlib.figure")
    found = spring({"x": position(T)})
    ax = found.plot_residuals(ax=figure.Figure().subplots())
    assert len(ax.lines) == 2 and ax.get_ylabel() == "residual"


def test_standard_errors_are_scaled_unless_sigma_is_absolute():
    """For a sigma of twice the size, errors stay or double."""
    t = np.linspace(0.0, 3.0, 25)
    data = {"x": np.cos(t) + 0.01 * np.sin(9.0 * t)}

    def fitted(sigma, **more):
        given = dict(coordinates=["x"], parameters={"k": 1.1}, sigma=sigma, **more)
        return hz.fit("x'^2/2 - k*x^2/2", [1.0], [0.0], t, data, ["k"], **given)

    one, other = fitted(0.01), fitted(0.02)
    assert abs(one.error("k") / other.error("k") - 1) < 1e-6
    assert "standard errors are scaled by the residuals" in str(one)
    one, other = fitted(0.01, absolute_sigma=True), fitted(0.02, absolute_sigma=True)
    assert abs(2 * one.error("k") / other.error("k") - 1) < 1e-6
    # The covariance is the inverse of J^T J.
    assert abs(one.error("k") * np.linalg.norm(one.jacobian) - 1) < 1e-9
    assert "those of the given deviations" in str(one)
    for sigma in (None, {}):
        with pytest.raises(ValueError, match="`absolute_sigma` is given without `sigma`"):
            fitted(sigma, absolute_sigma=True)


def test_parameters_of_data_alone_are_used():
    t = np.linspace(0.0, 3.0, 7)
    found = hz.fit("x'^2/2 - x^2/2", [1.1], [0.0], t, {"a*x": 2 * np.cos(t)}, ["x"], coordinates=["x"], parameters={"a": 2.0})
    assert abs(found["x"] - 1.0) < 1e-9
