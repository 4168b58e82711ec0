//! `herglotz fit`: tables and figures of fits, and messages for invalid ones.

use crate::support::{Directory, column, fail, refuses_each, scene, succeed};
use std::f64::consts::TAU;

/// x'' = -k x + gamma x' from 1 at rest; the fit starts elsewhere.
const SPRING: &str = r#"[system]
coordinates = ["x"]
lagrangian = "x'^2/2 - k*x^2/2 + gamma*z"
parameters = { k = 0.9, gamma = -0.09 }
[start]
x = 1.0
"x'" = 0.0
[run]
time = 40.0
integrator = "gauss_8"
step = 0.4
[fit]
csv = "data.csv"
unknowns = ["k", "gamma"]
"#;

/// The position and the velocity for k = 1, gamma = -0.1.
fn exact(t: f64) -> (f64, f64) {
    let w = f64::sqrt(0.9975);
    let decay = f64::exp(-0.05 * t);
    let x = decay * (f64::cos(w * t) + 0.05 / w * f64::sin(w * t));
    (x, -decay / w * f64::sin(w * t))
}

/// 101 positions with an error of this size, in a pattern with mean zero that no motion has.
fn data(error: f64) -> String {
    let row = |i: u32| {
        let t = 0.4 * f64::from(i);
        let deviation = error * f64::sin(TAU * f64::from(i * i % 101) / 101.0);
        format!("{t:e},{:e}", exact(t).0 + deviation)
    };
    ["t,x".to_owned()].into_iter().chain((0..=100).map(row)).collect::<Vec<_>>().join("\n")
}

#[test]
fn exact_data_are_fitted_to_the_accuracy_of_the_motion() {
    let at = Directory::new("fit_exact");
    at.write("data.csv", &data(0.0));
    let file = at.write("scene.toml", SPRING);
    let report = succeed(&["fit", &file, "--out", &at.path("out"), "--json"]);
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert_eq!(
        (&report["converged"], &report["degrees_of_freedom"], &report["rank"]),
        (&true.into(), &99.into(), &2.into())
    );
    // As many as the task in another library's book is allowed to take, which takes 42.
    assert!(report["iterations"].as_u64().unwrap() <= 10, "{report}");
    let fit = at.read("out/fit.csv");
    assert!(
        fit.starts_with("unknown,value,standard_error,bound,correlation with k,correlation with gamma\nk,"),
        "{fit}"
    );
    // The truncation error of gauss_8 with this step is below 1e-13, and the position is known to 1e-16.
    for (found, expected) in column(&fit, "value").iter().zip([1.0, -0.1]) {
        assert!((found - expected).abs() < 1e-12, "{fit}");
    }
    let residuals = at.read("out/residuals.csv");
    assert!(residuals.starts_with("quantity,t,measured,fitted,residual\nx,0.0000000000000000e0,1.0"), "{residuals}");
    assert!(column(&residuals, "residual").iter().all(|r| r.abs() < 1e-12), "{residuals}");
}

/// The standard error of the first unknown.
fn error_of(report: &str) -> f64 {
    let report: serde_json::Value = serde_json::from_str(report).unwrap();
    report["unknowns"][0]["standard_error"].as_f64().unwrap()
}

/// A column whose name is no identifier is fitted by its quantity, and standard errors are scaled by the residuals unless the
/// deviations are absolute.
#[test]
fn columns_of_any_name_and_absolute_deviations() {
    let at = Directory::new("fit_columns");
    at.write("data.csv", &data(0.01).replace("t,x", "t,Angle (rad)"));
    let with = |sigma: f64, more: &str| {
        let options =
            format!("observe = {{ \"Angle (rad)\" = \"x\" }}\nsigma = {{ \"Angle (rad)\" = {sigma:?} }}\n{more}");
        let file = at.write("scene.toml", &format!("{SPRING}{options}"));
        succeed(&["fit", &file, "--out", &at.path("out"), "--json"])
    };
    let known = "absolute_sigma = true\n";
    let ratio = |more: &str| error_of(&with(0.02, more)) / error_of(&with(0.01, more));
    assert!((ratio("") - 1.0).abs() < 1e-6 && (ratio(known) - 2.0).abs() < 1e-6);
    let file = at.path("scene.toml");
    let said = succeed(&["fit", &file, "--out", &at.path("out")]);
    assert!(said.contains("standard errors are those of the given deviations"), "{said}");
    assert!(said.contains("written: ") && said.contains("fit.csv, ") && said.ends_with("residuals.csv\n"), "{said}");
    with(0.01, "");
    let said = succeed(&["fit", &file, "--out", &at.path("out")]);
    assert!(said.contains("standard errors are scaled by the residuals"), "{said}");
}

/// A file with another separator than commas is refused with it.
#[test]
fn another_separator_is_named() {
    let at = Directory::new("fit_separator");
    let file = at.write("scene.toml", SPRING);
    for (separator, name) in [(";", "semicolons"), ("\t", "tabs"), ("|", "`|`"), (" ", "blanks")] {
        at.write("data.csv", &data(0.0).replace(',', separator));
        let (code, said) = fail(&["fit", &file, "--out", &at.path("out")]);
        assert_eq!(code, Some(2));
        assert!(said.contains(&format!("seem to be separated by {name}; separate them by commas")), "{said}");
    }
}

/// Everything that a scene can say of a fit, on data with errors.
#[test]
fn velocities_deviations_bounds_losses_starts_and_pieces() {
    let at = Directory::new("fit_options");
    // Velocities at every other time, each with its deviation, and one outlier among the positions.
    let row = |i: u32| {
        let t = 0.4 * f64::from(i);
        let (x, v) = exact(t);
        let error = 0.01 * f64::sin(TAU * f64::from(i * i % 101) / 101.0);
        let x = if i == 50 { 3.0 } else { x + error };
        let of_velocity = if i.is_multiple_of(2) { format!("{:e},0.02", v - 2.0 * error) } else { ",".to_owned() };
        format!("{t:e},{x:e},{of_velocity}")
    };
    let rows: Vec<String> = ["time,x,v,s".to_owned()].into_iter().chain((0..=100).map(row)).collect();
    at.write("data.csv", &rows.join("\n"));
    let options = r#"time = "time"
observe = ["x", "v = x'"]
sigma = { x = 0.01, v = "s" }
unknowns = ["k", "gamma", "start.x", "start.x'"]
bounds = { k = [0.0, 5.0], start.x = [1.0, 1.0], gamma = [-inf, -0.05] }
loss = { cauchy = 3.0 }
starts = [{ k = 1.1, start."x'" = 0.1 }, { k = 3.5 }]
pieces = 8
evaluations = 500
"#;
    let text = SPRING.replace("unknowns = [\"k\", \"gamma\"]\n", options);
    let file = at.write("scene.toml", &text);
    let report = succeed(&["fit", &file, "--out", &at.path("out"), "--plot"]);
    assert!(
        report.starts_with("converged: ")
            && report.lines().any(|l| l.starts_with("start.x   1 ") && l.contains("held fixed")),
        "{report}"
    );
    assert!(
        report.contains("the pieces of the motion meet to") && report.contains("the cost from each start:"),
        "{report}"
    );
    let fit = at.read("out/fit.csv");
    assert!(fit.lines().nth(3).unwrap().starts_with("start.x,1.0000000000000000e0,,fixed,"), "{fit}");
    let numbers = |row: usize| -> Vec<f64> {
        fit.lines().nth(row).unwrap().split(',').filter_map(|entry| entry.parse().ok()).collect()
    };
    // Within four standard errors of the truth. The motion decays in 20 units of time, 50 positions, a quarter of which
    // count for each of four unknowns: the errors are about 0.01/sqrt(12) or less.
    for (row, expected) in [(1, 1.0), (2, -0.1), (4, 0.0)] {
        let [value, error, ..] = numbers(row)[..] else { panic!("{fit}") };
        assert!((value - expected).abs() < 4.0 * error && error < 5e-3, "{fit}");
    }
    let residuals = at.read("out/residuals.csv");
    assert_eq!(residuals.lines().count(), 1 + 101 + 51);
    assert_eq!(residuals.lines().filter(|line| line.starts_with("v = x',")).count(), 51);
    let largest = column(&residuals, "residual").into_iter().fold(0.0, f64::max);
    let outlier = column(&residuals, "residual").into_iter().fold(0.0, f64::min);
    // The outlier, of 200 and more deviations, is left alone.
    assert!(outlier < -200.0 && largest < 3.0, "{residuals}");
    for picture in ["fit.svg", "residuals.svg"] {
        assert!(at.read(&format!("out/{picture}")).contains("<svg"), "{picture}");
    }
}

#[test]
fn the_scene_of_a_fit_finds_its_values() {
    let at = Directory::new("fit_scene");
    let report = succeed(&["fit", &scene("fit_spring"), "--out", &at.path("out")]);
    assert!(report.starts_with("converged: "), "{report}");
    let fit = at.read("out/fit.csv");
    // The data were made with these values and normal errors: four standard errors are exceeded once in 4000 fits.
    let truth = [2.0, -0.3, 1.0, 0.5];
    for ((found, error), truth) in column(&fit, "value").iter().zip(column(&fit, "standard_error")).zip(truth) {
        assert!((found - truth).abs() < 4.0 * error, "{fit}");
    }
}

/// Data that do not determine the unknowns, and a scene without data.
#[test]
fn what_the_data_do_not_determine_is_named() {
    let at = Directory::new("fit_null");
    at.write("data.csv", &data(0.01));
    let of_mass =
        SPRING.replace("x'^2/2", "m*x'^2/2").replace("k = 0.9", "k = 0.9, m = 1.0").replace("\"k\",", "\"k\", \"m\",");
    let file = at.write("mass.toml", &of_mass);
    let (code, report) = fail(&["fit", &file, "--out", &at.path("out")]);
    assert!(
        code == Some(1) && report.contains("the Jacobian has rank 2 of 3; the model does not change with"),
        "{report}"
    );
    assert!(report.contains("the model does not change with `k` : `m` = 1.0000 : "), "{report}");
    assert!(at.read("out/fit.csv").contains("\nk,"));
    at.write("data.csv", "t,x\n1,0.5\n");
    let file = at.write("few.toml", SPRING);
    let (code, report) = fail(&["fit", &file, "--out", &at.path("out")]);
    assert_eq!(code, Some(2), "{report}");
    assert!(
        report.contains("few.toml, line 13, column 7: 1 measured values cannot determine 2 parameters"),
        "{report}"
    );
    assert!(report.contains("the model does not change with `k` : `gamma` = 1.0000 :"), "{report}");
    let file = at.write("none.toml", SPRING.split("[fit]").next().unwrap());
    let (code, report) = fail(&["fit", &file, "--out", &at.path("out")]);
    assert!(code == Some(2) && report.contains("none.toml: the scene has no data; add [fit]"), "{report}");
}

#[test]
fn invalid_fits_are_refused_with_their_place() {
    let at = Directory::new("fit_invalid");
    at.write("data.csv", "t,x,s\n1,0.5,0.1\n2,-0.3,0.1\n3,-0.8,0.1\n");
    at.write("late.csv", "t,x\n1,0.5\n41,0.5\n");
    at.write("nan.csv", "t,x\n1,0.5\n2,NaN\n");
    at.write("word.csv", "t,x\n1,0.5\n2,high\n");
    at.write("start.csv", "t,x\n0,0.5\n0,0.6\n");
    at.write("sigma.csv", "t,x,s\n1,0.5,0.1\n2,0.5,-1\n");
    let with = SPRING.replace("csv = \"data.csv\"", "csv = \"data.csv\"\nobserve = [\"x\"]");
    let report = |text: &str| {
        let file = at.write("scene.toml", text);
        let (code, report) = fail(&["fit", &file, "--out", &at.path("out")]);
        (code == Some(2))
            .then(|| report.split_once("scene.toml, ").map_or(report.clone(), |(_, report)| report.to_owned()))
    };
    let changes = [
        (
            "\"k\", \"gamma\"",
            "\"kk\"",
            "line 15, column 13: unknown name `kk` in [fit]; the names that can be fitted are k, gamma, start.x",
        ),
        ("\"k\", \"gamma\"", "\"start.y\"", "line 15, column 13: unknown name `y` in the start"),
        ("\"k\", \"gamma\"", "\"start.t\"", "line 15, column 13: the motion starts at a fixed time; fit another value"),
        ("\"k\", \"gamma\"", "\"start.p_x\"", "line 15, column 13: the start is given by velocities; fit one of them"),
        ("\"k\", \"gamma\"", "\"k\", \"k\"", "line 15, column 18: `k` is given twice"),
        ("\"k\", \"gamma\"", "", "line 15, column 12: there are no unknowns"),
        ("data.csv", "none.csv", "line 13, column 7: there is no file \"none.csv\""),
        (
            "data.csv",
            "late.csv",
            "line 13, column 7: line 3 of the file \"late.csv\" has \"41\" for `t`; the motion runs from 0 to 40",
        ),
        (
            "data.csv",
            "nan.csv",
            "line 13, column 7: line 3 of the file \"nan.csv\" has \"NaN\" for `x`; it must be a finite number",
        ),
        (
            "data.csv",
            "word.csv",
            "line 13, column 7: line 3 of the file \"word.csv\" has \"high\" for `x`; it must be a number",
        ),
        (
            "data.csv",
            "start.csv",
            "line 13, column 7: the file \"start.csv\" has no data after the start of the motion",
        ),
        (
            "data.csv\"",
            "sigma.csv\"\nsigma = { x = \"s\" }",
            "line 13, column 7: line 3 of the file \"sigma.csv\" has \"-1\" for `s`; a standard deviation must be positive",
        ),
        ("observe = [\"x\"]", "observe = [\"y\"]", "line 14, column 13: unknown name `y`"),
        ("observe = [\"x\"]", "observe = [\"t\"]", "line 14, column 12: the column `t` is the time"),
        (
            "observe = [\"x\"]",
            "observe = [\"sigma\"]",
            "line 14, column 12: the column `sigma` contains `sigma` or `log_factor`",
        ),
        (
            "observe = [\"x\"]",
            "observe = [\"e = energy\"]",
            "line 14, column 12: the file \"data.csv\" has no column `e`; its columns are t, x, s",
        ),
        ("observe = [\"x\"]", "observe = []", "line 14, column 11: nothing is observed"),
        ("observe = [\"x\"]\n", "", "line 13, column 7: the column `s` is no quantity of the motion"),
        (
            "observe",
            "sigma = { y = 0.1 }\nobserve",
            "line 14, column 11: `y` is not observed; the observed columns are x",
        ),
        ("observe", "sigma = { x = 0.0 }\nobserve", "line 14, column 15: `x` is 0.0; it must be a positive number"),
        ("observe", "sigma = { x = \"r\" }\nobserve", "line 14, column 15: the file \"data.csv\" has no column `r`"),
        ("observe", "time = \"time\"\nobserve", "line 14, column 8: the file \"data.csv\" has no column `time`"),
        (
            "observe",
            "bounds = { kk = [0, 1] }\nobserve",
            "line 14, column 12: `kk` is not an unknown of the fit; these are k, gamma; did you mean `k`?",
        ),
        ("observe", "bounds = { k = [0] }\nobserve", "line 14, column 16: the bounds of `k` are 1 numbers; give two"),
        (
            "observe",
            "bounds = { k = [1, 0] }\nobserve",
            "line 14, column 16: the bounds of `k` are 1 and 0; the lower one",
        ),
        (
            "observe",
            "bounds = { k = [1, 2] }\nobserve",
            "line 14, column 16: the fit starts at k = 0.9, which is not between the bounds 1 and 2",
        ),
        ("observe", "loss = { huber = 0 }\nobserve", "line 14, column 8: `loss` is 0.0; it must be a positive number"),
        (
            "observe",
            "loss = { hubert = 1.0 }\nobserve",
            "line 14, column 8: unknown word `hubert`, expected one of `huber`, `soft_l1`, `cauchy`; did you mean `huber`?",
        ),
        (
            "observe",
            "loss = \"huber\"\nobserve",
            "line 14, column 8: the loss \"huber\" has no scale, the residual at which outliers begin; write { huber = 2.0 }",
        ),
        (
            "observe",
            "loss = 2.0\nobserve",
            "line 14, column 8: invalid type: number `2.0`, expected a loss with its scale, as in { huber = 2.0 }",
        ),
        (
            "observe",
            "loss = {}\nobserve",
            "line 14, column 8: the loss is empty; give a loss with its scale, as in { huber = 2.0 }",
        ),
        (
            "observe",
            "absolute_sigma = true\nobserve",
            "line 13, column 7: `absolute_sigma` is given, but `sigma` has no `x`; add it",
        ),
        (
            "observe = [\"x\"]",
            "observe = { \"Angle (rad)\" = \"x\" }",
            "line 14, column 13: the file \"data.csv\" has no column `Angle (rad)`",
        ),
        ("observe = [\"x\"]", "observe = { x = \"y\" }", "line 14, column 18: unknown name `y`"),
        (
            "observe = [\"x\"]",
            "observe = 1",
            "line 14, column 11: invalid type: integer `1`, expected a list of columns, as in [\"x\"], or a table of quantities",
        ),
        ("observe", "nodes = [1.0, 50.0]\nobserve", "line 14, column 15: the time 50 is outside of the motion"),
        (
            "observe",
            "nodes = [1.0, 5.0]\nobserve",
            "line 14, column 9: the node 1 is at 5; nodes must ascend strictly between the start and the last observation, 0 and 3",
        ),
        (
            "observe",
            "nodes = [1.0]\npieces = 2\nobserve",
            "line 15, column 10: give `nodes` or a number of `pieces`, not both",
        ),
        ("observe", "pieces = 0\nobserve", "line 14, column 10: `pieces` is 0"),
        ("observe", "starts = [{ m = 1.0 }]\nobserve", "line 14, column 13: `m` is not an unknown of the fit"),
        ("observe", "starts = [{ k = nan }]\nobserve", "line 14, column 17: `k` is NaN; it must be a finite number"),
        ("observe", "evaluations = 0\nobserve", "line 14, column 15: `evaluations` is 0"),
        ("time = 40.0", "time = -40.0", "line 12, column 1: a fit requires a motion forward in time"),
    ];
    refuses_each(&with, &changes, report);
}
