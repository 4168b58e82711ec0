//! Scenes of paths between given ends.

use crate::support::{Directory, column, fail, refuses_each, succeed};
use herglotz::EndsScene;

/// x'' = -x + gamma x' from 0 to 1.
const OSCILLATOR: &str = r#"[system]
coordinates = ["x"]
lagrangian = "x'^2/2 - x^2/2 + gamma*z"
parameters = { gamma = -0.2 }
[start]
x = 0.0
t = 1.0
z = 0.25
[ends]
x = 1.0
t = 3.0
[run]
steps = 40
"#;

/// The position and the velocity in closed form.
fn exact(t: f64) -> (f64, f64) {
    let (gamma, w) = (-0.2, f64::sqrt(0.99));
    let a = 1.0 / (f64::exp(gamma) * f64::sin(2.0 * w));
    let s = t - 1.0;
    let decay = a * f64::exp(0.5 * gamma * s);
    (decay * f64::sin(w * s), decay * (0.5 * gamma * f64::sin(w * s) + w * f64::cos(w * s)))
}

/// The rows are those of the motion, the figures are written, and the quality of the path is reported.
#[test]
fn a_path_between_ends_runs() {
    let at = Directory::new("ends");
    let file = at.write("scene.toml", OSCILLATOR);
    let said = succeed(&["run", &file, "--out", &at.path("out"), "--plot"]);
    assert!(said.starts_with("found: a path of 40 steps of 0.05 by gauss_4, in "), "{said}");
    assert!(
        said.contains("no estimate of the truncation error") && said.contains("the regularity of its ends is"),
        "{said}"
    );
    let rows = at.read("out/rows.csv");
    assert!(rows.starts_with("t,x,x',p_x,z\n1.0000000000000000e0,0.0000000000000000e0,"), "{rows}");
    let [t, x, v, p] = ["t", "x", "x'", "p_x"].map(|name| column(&rows, name));
    assert_eq!((t.len(), t[40], x[40], column(&rows, "z")[0]), (41, 3.0, 1.0, 0.25));
    for k in 0..=40 {
        let (position, velocity) = exact(t[k]);
        // A method of order 8 with steps of 0.05.
        assert!((x[k] - position).abs() < 1e-11 && (v[k] - velocity).abs() < 1e-10 && (p[k] - v[k]).abs() < 1e-14);
    }
    for picture in ["columns.svg", "phase.svg"] {
        assert!(at.read(&format!("out/{picture}")).contains("<svg"), "{picture}");
    }
    // A rule of order two estimates by how much its truncation error displaces the path.
    let by_rule = at.write("rule.toml", &OSCILLATOR.replace("steps = 40", "steps = 40\nintegrator = \"midpoint\""));
    let told = succeed(&["run", &by_rule, "--out", &at.path("rule"), "--json"]);
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    let rows = at.read("rule/rows.csv");
    let error = column(&rows, "t").into_iter().zip(column(&rows, "x")).map(|(t, x)| (x - exact(t).0).abs());
    let (error, estimate) = (error.fold(0.0, f64::max), told["estimated_error"].as_f64().unwrap());
    // The estimate is in units of the range of x, which is slightly above one.
    assert!(0.5 * error < estimate && estimate < 2.0 * error, "{estimate} for {error}");
    assert_eq!((&told["status"], &told["unresolved"]), (&"found".into(), &serde_json::Value::Null));
    assert!(told["regularity"].as_f64().unwrap() > 1e-3 && told["rows"] == 41 && told["steps"] == 40, "{told}");
    assert!((told["start"]["x'"].as_f64().unwrap() - exact(1.0).1).abs() < 1e-2, "{told}");
    // The rate is constant.
    assert!((told["log_factor"].as_f64().unwrap() + 0.4).abs() < 1e-3, "{told}");
}

/// Where there is no path, the exit code is 1; a path that may be far from every motion is flagged as unresolved.
#[test]
fn what_a_path_is_worth_is_told() {
    let at = Directory::new("ends_flagged");
    let free = OSCILLATOR.replace("gamma = -0.2", "gamma = 0.0");
    // With ends half a period apart the ends are conjugate; the truncation error shifts that time.
    let half = free.replace("t = 3.0", "t = 4.14159265358979").replace("= 40", "= 40\nintegrator = \"midpoint\"");
    let (code, told) = fail(&["run", &at.write("half.toml", &half), "--out", &at.path("half"), "--json"]);
    assert!(code == Some(0) && told.starts_with("warning: ") && told.contains("does not resolve"), "{code:?} {told}");
    // The exact time that 40 midpoint steps take for half a period.
    let h = 2.0 * (std::f64::consts::PI / 80.0).tan();
    let conjugate = half.replace("4.14159265358979", &format!("{:?}", 1.0 + 40.0 * h));
    let (code, told) = fail(&["run", &at.write("none.toml", &conjugate), "--out", &at.path("none")]);
    assert!(code == Some(1) && (told.contains("conjugate") || told.contains("stalled")), "{code:?} {told}");
    assert!(at.read("none/rows.csv").lines().count() == 42);
}

/// Errors are reported with their position.
#[test]
fn wrong_scenes_of_paths_are_refused() {
    let at = Directory::new("ends_wrong");
    let changes = [
        ("x = 1.0", "y = 1.0", "line 10, column 1: unknown name `y` in the end of a path; the known names are x, t"),
        ("x = 1.0\n", "", "line 9, column 1: the coordinate `x` has no value at the end; add `x = 0.0` to [ends]"),
        ("t = 3.0\n", "", "line 9, column 1: the end of the path has no time; add `t = 1.0` to [ends]"),
        ("t = 3.0", "t = 1.0", "line 11, column 5: the path starts and ends at t = 1"),
        ("t = 3.0", "t = inf", "line 11, column 5: `t` is inf; it must be a finite number"),
        (
            "t = 3.0",
            "t = 3.0\nz = 1.0",
            "line 12, column 1: unknown name `z` in the end of a path; the known names are x, t",
        ),
        (
            "x = 0.0",
            "x = 0.0\n\"x'\" = 1.0",
            "line 7, column 1: unknown name `x'` in the start of a path; the known names are x, z, t; did you mean `x`?",
        ),
        ("steps = 40\n", "", "line 12, column 1: the run of a path has no `steps`, their number; add it"),
        ("steps = 40", "steps = 1", "line 13, column 9: `steps` is 1; it must be at least 2"),
        (
            "steps = 40",
            "accuracy = 1e-9",
            "line 13, column 12: `accuracy` does not apply to a path between two ends; remove it",
        ),
        (
            "steps = 40",
            "steps = 40\nintegrator = \"strang\"",
            "line 14, column 14: `integrator` is \"strang\", which has no discrete Lagrangian as a function of both ends of a step; \
             choose a Gauss method such as \"gauss_4\"",
        ),
        ("steps = 40", "steps = 40\nintegrator = \"gaus_4\"", "line 14, column 14: unknown integrator `gaus_4`"),
        ("-0.2 }", "-0.2, k = 1.0 }", "line 4, column 30: the parameter `k` is not used in the Lagrangian"),
        (
            "[run]",
            "[want]\nrows = { every = 0.1 }\n[run]",
            "line 13, column 8: `rows` does not apply to a path between two ends; remove it",
        ),
    ];
    refuses_each(OSCILLATOR, &changes, |text| {
        let (code, told) = fail(&["run", &at.write("bad.toml", text), "--out", &at.path("out")]);
        let (_, after_its_name) = told.split_once("bad.toml, ").filter(|_| code == Some(2))?;
        Some(after_its_name.to_owned())
    });
    let file = at.write("scene.toml", OSCILLATOR);
    for command in ["plan", "check", "compare", "sweep"] {
        let (code, told) = fail(&[command, &file]);
        assert!(
            code == Some(2) && told.contains("a path between ends works only with `herglotz run`"),
            "{command}: {told}"
        );
    }
    let (code, message) = fail(&["run", &file, "--out", &at.path("out"), "--resume"]);
    assert!(code == Some(2) && message.contains("--resume does not apply to a path"), "{message}");
    // A value that is set is that of the file.
    let of = |name: &str, arguments: &[&str]| {
        succeed(&[["run"].as_slice(), arguments, &["--out", &at.path(name)]].concat());
        at.read(&format!("{name}/rows.csv"))
    };
    let changed = at.write("changed.toml", &OSCILLATOR.replace("gamma = -0.2", "gamma = -0.1"));
    assert_eq!(of("set", &[&file, "--set", "gamma=-0.1"]), of("changed", &[&changed]));
    assert_ne!(of("set", &[&file, "--set", "gamma=-0.1"]), of("original", &[&file]));
    // A system of the catalogue has a default start, and arrays accept one number for all entries.
    let scene =
        EndsScene::read("[system]\ncatalogue = \"pendulum\"\n[ends]\ntheta = 0.5\nt = 2\n[run]\nsteps = 20\n").unwrap();
    assert_eq!(scene.problem.ends[1], [0.5]);
    let nine = "[system]\ncoordinates = [\"q[9]\"]\nlagrangian = \"sum(i, 0, 8, q'[i]^2)\"\n[start]\nq = 0\n[ends]\nq = 1\nt = 2\n[run]\nsteps = 20\n";
    let (code, told) = fail(&["run", &at.write("nine.toml", nine), "--out", &at.path("out")]);
    assert!(code == Some(2) && told.contains("line 3, column 14: `coordinates` are 9"), "{told}");
}
