//! Runs the program `work_precision` as a whole. Its unit tests use no integrator of the library.

#![allow(clippy::unwrap_used)] // Tests may unwrap, in helpers too.

use std::process::Command;

/// A table that the program writes.
fn table(name: &str, arguments: &[&str]) -> String {
    let out = std::env::temp_dir().join(format!("{name}_{}", std::process::id()));
    let program =
        Command::new(env!("CARGO_BIN_EXE_work_precision")).args(arguments).arg("--out").arg(&out).output().unwrap();
    assert!(program.status.success(), "{}", String::from_utf8_lossy(&program.stderr));
    let table = std::fs::read_to_string(out.join(name)).unwrap();
    std::fs::remove_dir_all(&out).unwrap();
    table
}

/// The midpoint rule on P6, which can be solved only with the action: the error is of second order, and the number of
/// steps is the duration over the step.
#[test]
fn the_midpoint_rule_is_of_second_order() {
    let table = table("work_precision.csv", &["--quick", "--problem", "P6", "--method", "midpoint"]);
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let column = |name: &str| header.iter().position(|column| *column == name).unwrap();
    let [h, steps, evaluations, error] = ["h", "steps", "evaluations", "error"].map(column);
    let rows: Vec<[f64; 4]> =
        lines.map(|line| [h, steps, evaluations, error].map(|i| line[i].parse().unwrap())).collect();
    for [h, steps, evaluations, _] in &rows {
        // Each step takes at least one iteration and one evaluation of the jet after it. P6 ends at t = 100.
        assert!(h * steps == 100.0 && *evaluations >= 2.0 * steps, "{h} {steps} {evaluations}");
    }
    let resolved: Vec<_> = rows.iter().filter(|row| (1e-8..1e-3).contains(&row[3])).collect();
    assert!(resolved.len() >= 3, "{table}");
    for pair in resolved.windows(2) {
        let slope = (pair[0][3] / pair[1][3]).ln() / (pair[0][0] / pair[1][0]).ln();
        assert!((slope - 2.0).abs() < 0.15, "{slope} between {:?} and {:?}", pair[0], pair[1]);
    }
}

/// Calls for a requested error have at most this error.
#[test]
fn calls_reach_the_requested_errors() {
    let table = table("calls.csv", &["--calls", "--problem", "P6f", "--z", "on"]);
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 4, "{table}");
    for row in rows {
        let [requested, error, ratio] = [2, 3, 9].map(|i| row[i].parse::<f64>().unwrap());
        assert!(error <= requested && ratio > 0.0, "{table}");
    }
}
