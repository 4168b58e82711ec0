//! What the program says of a run, and what it draws.

use crate::support::{Directory, fail, scene, succeed};
use std::path::Path;

/// A run names the files that it wrote, and the steps that it took in place of others.
#[test]
fn a_run_says_what_it_wrote() {
    let at = Directory::new("written");
    let out = at.path("out");
    let scene_of = |name: &str, figures: &[&str]| {
        let said = succeed(&["run", &scene(name), "--out", &out, "--plot"]);
        let line = said.lines().find(|line| line.starts_with("written: ")).unwrap_or_default();
        for file in figures {
            assert!(line.contains(&format!("{out}/{file}")), "{name}: {said}");
        }
        for file in line.trim_start_matches("written: ").split(", ") {
            assert!(Path::new(file).exists(), "{name}: {file}");
        }
    };
    scene_of("pendulum", &["rows.csv", "events.csv", "columns.svg", "phase.svg"]);
    scene_of("free_body", &["rows.csv", "polhode.svg"]);
    scene_of("chain", &["rows.csv"]);
    scene_of("lambert", &["rows.csv", "path.svg"]);
    let text = "system = { coordinates = [\"x\"], lagrangian = \"x'^2/2 - x^2/2\" }\nversion = 2\n\
                start = { x = 1.0, \"x'\" = 0.0 }\nrun = { time = 3.0, integrator = \"gauss_8\", step = 0.41 }\n";
    let file = at.write("scene.toml", text);
    let said = succeed(&["run", &file, "--out", &out]);
    assert!(said.starts_with("completed: 8 steps of 0.375 (in place of 0.41, so that they fill the span)"), "{said}");
    assert!(succeed(&["plan", &file]).contains("the steps of 0.41 became 0.375"));
    let file = at.write("scene.toml", &text.replace("0.41", "0.3"));
    assert!(!succeed(&["run", &file, "--out", &out]).contains("in place of"));
    let report: serde_json::Value = serde_json::from_str(&succeed(&["run", &file, "--out", &out, "--json"])).unwrap();
    assert_eq!(report["files"], serde_json::json!([format!("{out}/rows.csv")]));
}

/// The outline of the unit sphere is a circle.
#[test]
fn circles_are_round() {
    let at = Directory::new("round");
    succeed(&["run", &scene("free_body"), "--out", &at.path("out"), "--plot"]);
    let figure = at.read("out/polhode.svg");
    // The outline is the first curve: the longest list of points of the figure has 361 of them, or more.
    let points = |list: &str| -> Vec<f64> {
        list.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-')).filter_map(|x| x.parse().ok()).collect()
    };
    let lists = figure.split('"').map(points).find(|list| list.len() >= 2 * 361);
    let outline = lists.unwrap();
    let size = |first: usize| {
        let all = outline.iter().skip(first).step_by(2);
        let (low, high) = all.fold((f64::MAX, f64::MIN), |(low, high), x| (low.min(*x), high.max(*x)));
        high - low
    };
    // Points are written to a hundredth of a pixel.
    assert!(size(0) > 100.0 && (size(0) - size(1)).abs() <= 0.05, "{} {}", size(0), size(1));
}

/// A positive rate is warned of, and a table that nothing uses is refused.
#[test]
fn gains_of_energy_and_unused_tables() {
    let at = Directory::new("gains");
    let text = |gamma: &str| {
        format!(
            "version = 2\nsystem = {{ coordinates = [\"x\"], lagrangian = \"x'^2/2 - x^2/2 + gamma*z\", parameters = {{ gamma = {gamma} }} }}\n\
             start = {{ x = 1.0, \"x'\" = 0.0 }}\nrun = {{ time = 1.0, accuracy = 1e-6 }}\n"
        )
    };
    let warned = |gamma: &str| {
        let file = at.write("scene.toml", &text(gamma));
        fail(&["run", &file, "--out", &at.path("out")]).1.contains("so that the motion gains energy")
    };
    assert!(warned("0.1") && !warned("-0.1"));
    let table = "[tables.drive]\ntimes = [0.0, 1.0]\nvalues = [0.0, 1.0]\n";
    let file = at.write("scene.toml", &(text("-0.1") + table));
    let (code, said) = fail(&["run", &file, "--out", &at.path("out")]);
    assert!(code == Some(2) && said.contains("the table `drive` is used in no formula; write `drive(t)`"), "{said}");
}
