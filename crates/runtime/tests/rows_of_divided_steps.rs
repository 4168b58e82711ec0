//! Rows of steps that are divided at kinks, jumps and resets: on polynomials, as accurate as by steps that end there.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use formula_lagrangian::{Direction, Formula, Reset};
use herglotz_runtime::{AnyIntegrator, Column, Motion, OutputTimes, Start, StepControl, Steps, System};

const SPAN: f64 = 12.0;

/// The systems: kinks, a jump, resets, a force with a kink, a named time, and a rate that is not constant.
fn systems() -> Vec<(&'static str, System)> {
    let formula = |text: &str| Formula::parse(text, &["x"], &[("gamma", -0.07)]).unwrap();
    let oscillator = || formula("x'^2/2 - x^2/2 - x^4/8 + gamma*z");
    let wall = Reset { when: "x - 0.2", direction: Direction::Falling, then: &[("x'", "-0.9*x'")], rest: None };
    [
        ("kink", formula("x'^2/2 - abs(x - 0.3) - x^2/2 + gamma*z")),
        ("jump", formula("x'^2/2 - x^2/2 - if(x > 0.2, 0.1, 0) + gamma*z")),
        ("reset", formula("x'^2/2 - x^2/2 - x + gamma*z").with_reset(wall).unwrap()),
        ("force", oscillator().with_force("x", "-0.2*x'*abs(x')").unwrap()),
        ("time", formula("x'^2/2 - x^2/2 + if(t > 1.234, x, 0) + gamma*z")),
        ("rate", formula("x'^2/2 - abs(x) - x^2/2 - 0.02*z^2")),
    ]
    .map(|(name, formula)| (name, System::new(&formula).unwrap()))
    .to_vec()
}

/// The rows x, x', p, z and the logarithm of the conformal factor.
fn rows(system: &System, way: StepControl, exact: bool, end: f64) -> Vec<Vec<f64>> {
    let columns = ["x", "x'", "p_x", "z", "log_factor"].map(|name| Column::parse(name, system.formula()).unwrap());
    // Their distance is no part of any step.
    let times = (1..=600).map(|k| end * (f64::from(k) / 600.7)).collect();
    let rows = Some(OutputTimes::At(times));
    let start = Start::new(0.0, [1.0], [0.4], 0.1);
    let motion = Motion { rows, columns: columns.to_vec(), exact, ..Motion::new(start, end, way) };
    let (outcome, rows) = system.record(&motion).unwrap();
    assert!(outcome.t == end && rows.len() == 600, "{way:?}: {}", outcome.status);
    rows
}

fn distance(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let all = a.iter().flatten().zip(b.iter().flatten());
    all.map(|(a, b)| (a - b).abs()).fold(0.0, |most, d| if d <= most { most } else { d })
}

#[test]
fn rows_between_switches_are_as_accurate_as_steps_to_them() {
    let by = |stages, h| StepControl::Steps { by: AnyIntegrator::Gauss { stages }, steps: Steps::Size(h) };
    let accurate = |error| StepControl::Accuracy { error, by: None };
    let ways = [by(3, 0.1), by(6, 0.4), by(8, 0.3), by(12, 0.9), by(16, 1.5), accurate(1e-6), accurate(1e-10)];
    for (name, system) in systems() {
        for end in [SPAN, -2.0] {
            let reference = rows(&system, by(14, 0.1), true, end);
            for way in ways {
                let by_steps = distance(&rows(&system, way, true, end), &reference);
                let found = distance(&rows(&system, way, false, end), &reference);
                // The round-off of some hundred operations with numbers of the size 10.
                assert!(found <= 1.5 * by_steps + 1e-12, "{name}, {way:?}, to {end}: {found:e}, by steps {by_steps:e}");
            }
        }
    }
}
