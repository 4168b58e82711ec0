//! Scenes of rigid bodies.

use crate::support::{Directory, column, fail, refuses_each, succeed};
use herglotz::BodyScene;
use herglotz::runtime::RuntimeError;

/// A top that nods, with an event.
pub const TOP: &str = r#"[system.body]
inertia = [0.234375, 0.46875, 0.234375]
mass = 15.0
centre = [0.0, 1.0, 0.0]
gravity = [0.0, 0.0, -9.81]
gamma = -0.1
[start]
attitude = [1.0, 0.0, 0.0, 0.0]
omega = [0.0, 150.0, -4.61538]
[run]
time = 1.0
integrator = "gauss_4"
step = 0.005
[want]
rows = { every = 0.01, columns = ["t", "Pi2", "M3", "z"] }
events = [{ when = "tip_z + 0.3", direction = "falling", terminal = true }]
"#;

/// The rows have the momenta that decay as `e^(gamma t)`, the event ends the run, the figures are written, and commands
/// that do not apply are refused.
#[test]
fn a_rigid_body_runs() {
    let at = Directory::new("body");
    let (file, out) = (at.write("top.toml", TOP), at.path("out"));
    let said = succeed(&["run", &file, "--out", &out, "--plot"]);
    assert!(said.starts_with("stopped by the event tip_z + 0.3 at t = "), "{said}");
    let rows = at.read("out/rows.csv");
    assert!(rows.starts_with("t,Pi2,M3,z\n"), "{rows}");
    for name in ["Pi2", "M3"] {
        let momenta = column(&rows, name);
        for (t, momentum) in column(&rows, "t").iter().zip(&momenta) {
            // A rounding error for each of up to 200 steps.
            assert!((momentum / momenta[0] / (-0.1 * t).exp() - 1.0).abs() < 1e-13, "{name} at {t}");
        }
    }
    let heights = column(&at.read("out/events.csv"), "tip_z");
    assert!(heights.len() == 1 && (heights[0] + 0.3).abs() < 1e-13, "{heights:?}");
    for figure in ["polhode.svg", "path.svg"] {
        assert!(at.read(&format!("out/{figure}")).contains("<svg"), "{figure}");
    }
    let accurate = at.write("accurate.toml", &TOP.replace("step = 0.005", "accuracy = 1e-8"));
    let printed = succeed(&["run", &accurate, "--out", &out, "--json"]);
    let outcome: serde_json::Value = serde_json::from_str(&printed).unwrap();
    assert!(outcome["estimated_error"].as_f64().unwrap() <= 1e-8 && outcome["events"] == 1, "{outcome}");
    let (code, said) = fail(&["compare", &file]);
    assert!(code == Some(2) && said.contains("a rigid body works only with `herglotz run`"), "{said}");
}

/// Errors are reported with their position.
#[test]
fn wrong_bodies_are_refused() {
    let changes = [
        ("[0.234375, 0.46875, 0.234375]", "[1.0, 1.0, 3.0]", "line 2, column 11: `inertia` is refused: the principal"),
        ("[0.234375, 0.46875, 0.234375]", "[1.0, 1.0]", "line 2, column 11"),
        ("mass = 15.0", "", "line 1, column 1: `mass` is 0"),
        ("mass = 15.0", "mass = -1.0", "line 3, column 8: `mass` is -1"),
        ("centre = [0.0, 1.0, 0.0]", "", "line 5, column 11: `gravity` has no effect"),
        (
            "[1.0, 0.0, 0.0, 0.0]",
            "[1.0, 0.1, 0.0, 0.0]",
            "line 8, column 12: `attitude` is refused: the quaternion has the norm 1.00498",
        ),
        ("[0.0, 150.0,", "[nan, 150.0,", "line 9, column 9: `omega[0]` is NaN"),
        ("\"gauss_4\"", "\"midpoint\"", "line 10, column 1: `integrator` is \"midpoint\""),
        (
            "step = 0.005",
            "step = 0.05",
            "line 13, column 8: `step` is refused: the step h = 0.05 turns the body by 7.5",
        ),
        ("step = 0.005", "", "line 10, column 1: the run has neither"),
        ("\"Pi2\"", "\"Pi4\"", "line 15, column 40: unknown column `Pi4`"),
        ("tip_z + 0.3", "tip_w + 0.3", "line 16, column 21: unknown name `tip_w`"),
        ("tip_z + 0.3", "energy", "line 16, column 20: `when` contains `energy`"),
        (
            "omega = [",
            "spin = [",
            "line 9, column 1: unknown name `spin` in the start of a rigid body; the known names are attitude",
        ),
        (
            "omega = [0.0, 150.0, -4.61538]\n",
            "",
            "line 7, column 1: the start has no `omega`, the angular velocity in the body",
        ),
        ("[0.0, 150.0, -4.61538]", "\"i\"", "line 9, column 9: `omega` must be a list of 3 numbers"),
        ("[start]", "[start]\nz = [0.0]", "line 8, column 5: `z` must be a number"),
        ("time = 1.0\n", "", "line 10, column 1: the run has no `time`"),
        ("[run]", "[force]\nx = \"1\"\n[run]", "line 10, column 1: `force` does not apply to a rigid body"),
        ("[run]", "[run]\nexact = true", "line 11, column 9: `exact` does not apply to a rigid body"),
        ("terminal = true", "then = { omega1 = \"0\" }", "line 16, column 65: `then` does not apply to a rigid body"),
        ("[want]", "[want]\nestimate = true", "line 15, column 12: `estimate` does not apply to a rigid body"),
        (
            "[start]",
            "[system]\nparameters = { k = 1.0 }\n[start]",
            "line 8, column 16: `parameters` does not apply to a rigid body",
        ),
    ];
    refuses_each(TOP, &changes, |text| match BodyScene::read(text) {
        Err(error) => Some(error.to_string()),
        // Errors that are found when the body is run.
        Ok(scene) => {
            scene.body.run(&scene.motion, &mut ()).err().map(|error: RuntimeError| scene.explain(&error).to_string())
        }
    });
}
