"""Derivatives of motions: forward and by the adjoint."""

import re
import subprocess
import sys
from pathlib import Path

import herglotz as hz
import numpy as np
import pytest

L = "x'^2/2 - 1 + cos(x) + gamma*z"
GIVEN = dict(coordinates=["x"], parameters={"gamma": -0.01}, integrator="gauss_8", steps=400)

# The final state at T = 100 from (1, 1, 0), and its derivatives in q0, v0 and gamma, by a Taylor method with 40 digits.
END = (-0.591939247134, -0.633067337150, -1.747387946531)
IN_START = (5.65210486970, -5.53295490161, -3.94604242032)
IN_VELOCITY = (7.38154595869, -7.16085111397, -4.67301564412)
IN_GAMMA = (225.145071391822, -255.642934500038, -265.676953215921)


def pendulum(t=100.0, **change):
    return hz.solve(L, [1.0], [1.0], t, **GIVEN | change)


def close(found, expected, tolerance=1e-11):
    assert np.abs(np.asarray(found) - expected).max() <= tolerance * np.abs(expected).max(), (found, expected)


def end(s):
    return np.array([s.q[-1].ravel(), s.v[-1].ravel(), np.ravel(s.z[-1])])


def test_the_pendulum_of_reference():
    sol = pendulum()
    close(end(sol)[:, 0], END)
    found = sol.sensitivity(["x", "x'", "gamma"])
    assert found.q.shape == (2, 1, 3) and found.z.shape == (2, 3) and found.growth >= 1
    for k, expected in enumerate((IN_START, IN_VELOCITY, IN_GAMMA)):
        close(end(found)[:, k], expected)
    one = sol.sensitivity("gamma")
    assert one.q.shape == (2, 1) and one.z.shape == (2,)
    close(end(one)[:, 0], IN_GAMMA)


def test_the_adjoint_is_the_transpose():
    sol = pendulum()
    for row, (q, v, z) in enumerate([([1.0], None, None), (None, [1.0], None), (None, None, 1.0)]):
        slopes = sol.pullback(q=q, v=v, z=z)
        found = [slopes.q0[0], slopes.v0[0], slopes.parameters["gamma"]]
        close(found, [of[row] for of in (IN_START, IN_VELOCITY, IN_GAMMA)])
        assert slopes.p0 is None and slopes.growth >= 1


def test_an_accuracy_chooses_the_steps():
    sol = pendulum(accuracy=1e-12, integrator=None, steps=None)
    close(end(sol.sensitivity("gamma"))[:, 0], IN_GAMMA, 1e-9)


def test_rows_have_derivatives():
    times = np.linspace(0, 10, 7)
    sol = pendulum(times, steps=40)
    found = sol.sensitivity(["x", "z", "gamma"])
    close(found.q[0], [[1.0, 0.0, 0.0]])
    h = 1e-5
    near = [pendulum(times, steps=40, parameters={"gamma": -0.01 + s * h}) for s in (1, -1)]
    for name in "qvpz":
        difference = (getattr(near[0], name) - getattr(near[1], name)) / (2 * h)
        close(getattr(found, name)[..., 2], difference, 1e-7)
    # The adjoint of all rows.
    weights = np.cos(np.arange(7.0))
    slopes = sol.pullback(q=weights[:, None], p=np.ones((7, 1)), z=weights**2)
    for k, slope in enumerate((slopes.q0[0], slopes.z0, slopes.parameters["gamma"])):
        expected = weights @ found.q[:, 0, k] + found.p[:, 0, k].sum() + weights**2 @ found.z[:, k]
        assert abs(slope - expected) <= 1e-11 * np.abs(expected)


def test_derivatives_in_the_times():
    sol = pendulum(10.0, steps=40)
    found = sol.sensitivity(["t0", "t_end"])
    # L does not depend on t.
    close(found.q[-1, 0], sol.v[-1, 0] * np.array([-1.0, 1.0]), 1e-9)
    slopes = sol.pullback(q=[1.0])
    close([slopes.t0, slopes.t_end], found.q[-1, 0], 1e-11)


def test_a_start_with_a_momentum():
    given = GIVEN | dict(steps=40, parameters={"gamma": -0.01})
    sol = hz.solve("x'^2 - 1 + cos(x) + gamma*z", [1.0], t=10.0, p0=[2.0], **given)
    found = sol.sensitivity("p_x")
    slopes = sol.pullback(p=[1.0])
    assert slopes.v0 is None
    close(slopes.p0, found.p[-1])
    with pytest.raises(ValueError, match="given by its momentum"):
        sol.sensitivity("x'")


def test_losses():
    loss = hz.value_and_grad(lambda t, q, v, z, target: (q[0] - target) ** 2 + z * v[0])
    given = GIVEN | dict(parameters={"gamma": -0.01, "target": 0.5}, steps=40)
    value, slopes = loss(L, [1.0], [1.0], 10.0, **given)
    sol = pendulum(10.0, steps=40)
    q, v, z = sol.q[-1, 0], sol.v[-1, 0], sol.z[-1]
    close([value], [(q - 0.5) ** 2 + z * v])
    expected = sol.pullback(q=[2 * (q - 0.5)], v=[z], z=v)
    close([slopes.q0[0], slopes.v0[0], slopes.z0], [expected.q0[0], expected.v0[0], expected.z0])
    close([slopes.parameters["gamma"]], [expected.parameters["gamma"]])
    close([slopes.parameters["target"]], [-2 * (q - 0.5)])
    # The energy depends on gamma explicitly too.
    value, slopes = hz.value_and_grad("energy")(L, [1.0], [1.0], 10.0, **GIVEN | dict(steps=40))
    near = [pendulum(10.0, steps=40, parameters={"gamma": -0.01 + s * 1e-5}).energy[-1] for s in (1, -1)]
    close([slopes.parameters["gamma"]], [(near[0] - near[1]) / 2e-5], 1e-7)


def test_forces_and_tables_have_parameters():
    table = hz.table([0.0, 4.0, 10.0], [0.0, 1.0, 0.5])
    given = dict(parameters={"c": 0.2, "a": 0.7}, force={"x": "-c*x' + a*cos(2*t)"}, rayleigh="c*a*x'^2/2", coordinates=["x"])
    given |= dict(integrator="gauss_6", steps=40)
    sol = hz.solve("x'^2/2 - x^2/2", [1.0], [0.0], 5.0, **given)
    found = sol.sensitivity(["c", "a"])
    for k, name in enumerate(("c", "a")):
        change = [given["parameters"] | {name: given["parameters"][name] + s * 1e-5} for s in (1, -1)]
        near = [hz.solve("x'^2/2 - x^2/2", [1.0], [0.0], 5.0, **given | dict(parameters=p)).q[-1, 0] for p in change]
        close([found.q[-1, 0, k]], [(near[0] - near[1]) / 2e-5], 1e-7)
    assert table.name  # Tables have kinks, and motions through kinks have no derivatives.


@pytest.mark.parametrize("integrator", ["gauss_4", "gauss_12"])
def test_scipy_takes_the_jacobians(integrator):
    optimize = pytest.importorskip("scipy.optimize")
    times, truth = np.linspace(0, 8, 25), (-0.2, 1.3)

    def run(x):
        parameters = {"gamma": x[0], "k": x[1]}
        return hz.solve(
            "x'^2/2 - k*x^2/2 + gamma*z", [1.0], [0.0], times, coordinates=["x"], parameters=parameters,
            integrator=integrator, step=0.25,
        )

    data = run(truth).q[:, 0]
    fit = optimize.least_squares(
        lambda x: run(x).q[:, 0] - data, [-0.1, 1.0], jac=lambda x: run(x).sensitivity(["gamma", "k"]).q[:, 0, :], xtol=1e-14
    )
    close(fit.x, truth, 1e-9)
    loss = hz.value_and_grad("(x - 0.25)^2 + x'^2")

    def of(x):
        parameters = {"gamma": x[0], "k": x[1]}
        value, slopes = loss("x'^2/2 - k*x^2/2 + gamma*z", [1.0], [0.0], 8.0, coordinates=["x"], parameters=parameters)
        return value, np.array([*slopes.parameters.values()])

    found = optimize.minimize(of, truth, jac=True)
    assert found.fun < 1e-6


def run_section(file, title):
    """The names that the code of a section of the documentation defines."""
    pytest.importorskip("scipy.optimize")
    text = Path(__file__).parents[3].joinpath("docs", file).read_text()
    section = text.split(f"{title}\n")[1].split("\n## ")[0]
    names = {"np": np, "hz": hz}
    for code in re.findall(r"```python\n(.*?)```", section, re.S):
        for package in ("jax", "torch"):
            if f"herglotz.{package}" in code:
                pytest.importorskip(package)
        exec(code, names)
    return names


def test_the_section_of_the_documentation():
    names = run_section("python.md", "## Derivatives of motions")
    close(names["sol"].sensitivity("gamma").q[-1], [225.1450713918], 1e-11)
    # That of the bounces, of times with six digits.
    close(names["fit"].x, (0.8, 9.81), 1e-5)
    found = names["exponents"]
    assert abs(found.pairs[0].sum() - found.rate) <= 1e-12 and found.pairing_defect <= 1e-12
    assert names["values"].shape == (100,) and names["slopes_of_members"].parameters["gamma"].shape == (100,)


def test_the_section_of_the_guide():
    names = run_section("guide.md", "## 20. How the end depends on the start and on parameters")
    # The data are exact, up to the accuracy of the motions.
    close(names["fit"].x, (-0.2, 1.7), 1e-7)
    assert names["slopes"].shape == (3,) and names["tangent"].shape == () and np.isfinite(names["gamma"].grad.item())


def test_lyapunov_exponents():
    sol = pendulum(50.0, steps=200)
    found = sol.lyapunov_exponents()
    assert found.exponents.shape == found.of_second_half.shape == (3,) and found.pairs.shape == (1, 2)
    # Round-off of the tangent of each of 200 steps of the length 1/4.
    close([found.rate, found.pairs.sum(), found.exponents.sum()], [-0.01, -0.01, -0.02], 1e-11)
    assert found.pairing_defect <= 1e-12 and found.volume_defect <= 1e-12
    forced = hz.solve("x'^2/2 - x^2/2", [1.0], [0.0], 5.0, coordinates=["x"], force={"x": "-x'"}, integrator="gauss_4", step=0.1)
    found = forced.lyapunov_exponents()
    assert found.pairing_defect is None and found.volume_defect is None
    close([found.pairs.sum()], [-1.0], 1e-8)  # The volume of (q, p), which the drag contracts at the rate 1: of order 8.


def test_a_kink():
    # x(t) = x0 f(t/sqrt(x0)); in the last quarter of its period 4 sqrt(2), f(s) = 1 - (4 sqrt(2) - s)^2/2.
    sol = hz.solve("x'^2/2 - abs(x)", [1.0], [0.0], 5.0, coordinates=["x"], integrator="gauss_4", step=0.3)
    rest = 4 * np.sqrt(2) - 5
    close(sol.sensitivity("x").q[-1], [1 - rest**2 / 2 - 2.5 * rest], 1e-12)
    close(sol.pullback(q=[1.0]).q0, [1 - rest**2 / 2 - 2.5 * rest], 1e-12)


BOUNCING = dict(coordinates=["x"], parameters={"e": 0.8, "g": 9.81}, events=hz.Event("x", "falling", reset={"x'": "-e*x'"}))


def test_a_loss_of_a_motion_with_a_reset():
    """A ball from the height 1: it falls in sqrt(2/g), and rises with e sqrt(2 g)."""
    e, g = 0.8, 9.81
    value, slopes = hz.value_and_grad("x")("x'^2/2 - g*x", [1.0], [0.0], 1.0, **BOUNCING)
    since, speed = 1 - np.sqrt(2 / g), np.sqrt(2 * g)
    close([value], [e * speed * since - g * since**2 / 2], 1e-9)
    # `e` is used by the reset alone.
    close([slopes.parameters["e"]], [speed * since], 1e-9)
    in_g = e * (since / speed + speed / (2 * g) * np.sqrt(2 / g)) - since**2 / 2 - since * np.sqrt(2 / g) / 2
    close([slopes.parameters["g"]], [in_g], 1e-9)
    # Coupled to an event, a loss is refused where its motion ends at a time that depends on the variables.
    with pytest.raises(ValueError, match="terminal event.*fixed time"):
        hz.value_and_grad("x")("x'^2/2 - x^2/2", [1.0], [0.0], 2.0, coordinates=["x"], events=hz.Event("x", terminal=True))


def test_a_loss_of_a_motion_with_a_reset_in_jax():
    jax = pytest.importorskip("jax")
    import herglotz.jax as hj

    jax.config.update("jax_enable_x64", True)
    value, slopes = hz.value_and_grad("x")("x'^2/2 - g*x", [1.0], [0.0], 1.0, **BOUNCING)

    def final(e):
        given = dict(coordinates=["x"], parameters={"e": e, "g": 9.81}, events=BOUNCING["events"])
        return hj.solve("x'^2/2 - g*x", [1.0], [0.0], 1.0, **given).q[-1, 0]

    assert jax.value_and_grad(final)(0.8) == (value, slopes.parameters["e"])
    close(jax.vmap(jax.grad(final))(np.array([0.8, 0.7])), 2 * [slopes.parameters["e"]], 1e-12)


COARSE = dict(integrator="gauss_2", step=1.5)


def test_gradients_tell_of_steps_that_do_not_resolve_the_motion():
    sol = hz.solve("pendulum", [2.8], [0.0], 20.0, **COARSE)
    assert "does not resolve" in sol.unresolved
    _, slopes = hz.value_and_grad("theta")("pendulum", [2.8], [0.0], 20.0, **COARSE)
    assert slopes.unresolved == sol.pullback(q=[1.0]).unresolved == sol.unresolved
    _, slopes = hz.value_and_grad("theta")("pendulum", [2.8], [0.0], 20.0)
    assert slopes.unresolved is None
    start = np.array([[2.8]]), np.zeros((1, 1)), 20.0
    many = hz.ensemble("pendulum", *start, **COARSE)
    _, slopes = hz.ensemble_value_and_grad("theta")("pendulum", *start, **COARSE)
    assert many.troubles == slopes.troubles == many.sensitivity("gamma").troubles == {0: sol.unresolved}
    assert np.isfinite(slopes.q0).all()


def test_jax_warns_of_steps_that_do_not_resolve_the_motion():
    pytest.importorskip("jax")
    import herglotz.jax as hj

    with pytest.warns(UserWarning, match="does not resolve"):
        hj.solve("pendulum", [2.8], [0.0], 20.0, **COARSE).q.block_until_ready()


@pytest.mark.parametrize("package", ["jax", "torch"])
def test_a_package_that_is_missing(package):
    code = f"import sys; sys.modules[{package!r}] = None; import herglotz.{package}"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert f"herglotz.{package} needs the package `{package}`; install it with `pip install {package}`" in done.stderr


SAID = {
    "an unknown parameter": (lambda: pendulum(1.0).sensitivity("gama"), "no variable `gama`; did you mean `gamma`"),
    "an unknown name": (lambda: pendulum(1.0).sensitivity("omega"), "no variable `omega`; .*x, x', gamma, z, t0, t_end"),
    "a number as name": (lambda: pendulum(1.0).sensitivity([1]), "`variables` is .*must be a name"),
    "an integrator without tangent": (
        lambda: hz.solve(
            "x'^2/2 - abs(x)", [1.0], [0.0], 1.0, coordinates=["x"], integrator="midpoint", steps=10
        ).sensitivity("x"),
        "not implemented; choose a Gauss method such as \"gauss_8\"",
    ),
    "a terminal event": (
        lambda: pendulum(10.0, events=hz.Event("x", terminal=True)).pullback(q=[1.0]),
        "terminal event.*fixed time",
    ),
    "a motion that fails": (
        lambda: hz.solve("x'^2/2 + 1/x", [1.0], [0.0], 5.0, coordinates=["x"], integrator="gauss_4", steps=50).pullback(q=[1.0]),
        "no derivatives, since it was not completed: ",
    ),
    "another shape": (lambda: pendulum(1.0).pullback(q=[1.0, 2.0]), r"`q` has the shape \(2,\); it must be \(2, 1\)"),
    "something infinite": (lambda: pendulum(1.0).pullback(q=[np.inf]), "`q` is not finite"),
    "a loss that is not a number": (
        lambda: hz.value_and_grad("sqrt(x - 100)")(L, [1.0], [1.0], 1.0, **GIVEN),
        "the loss is NaN",
    ),
    "a loss of the conformal factor": (
        lambda: hz.value_and_grad("x*sigma")(L, [1.0], [1.0], 1.0, **GIVEN),
        "not functions of the final state",
    ),
    "a loss with an unknown name": (
        lambda: hz.value_and_grad("x - y")(L, [1.0], [1.0], 1.0, **GIVEN),
        "the loss \"x - y\": .*unknown name `y`",
    ),
}


@pytest.mark.parametrize("what", SAID)
def test_invalid_input(what):
    call, message = SAID[what]
    with pytest.raises(ValueError, match=f"(?s){message}"):
        call()


@pytest.mark.parametrize(
    "given, named, message",
    [
        (("x'^2/2", [1.0], [0.0], 1.0, 2), {}, "too many positional arguments"),
        (("x'^2/2", [1.0]), {"q0": [1.0]}, "multiple values for argument 'q0'"),
        (("x'^2/2", [1.0], [0.0], 1.0), {"accurracy": 1e-8}, "unexpected keyword argument 'accurracy'"),
    ],
)
def test_calls_that_solve_does_not_take_are_refused_by_name(given, named, message):
    with pytest.raises(TypeError, match=message):
        hz.value_and_grad("x")(*given, **named)


def test_a_call_without_a_system_says_what_is_missing():
    with pytest.raises(ValueError, match="give either `L` or `H`"):
        hz.value_and_grad("x")()
