//! Scales: very small and very large steps, states and times, over the range of doubles.

use crate::damping::{Tally, bad};
use crate::formula::{Force, Formula};
use crate::motion::{FAMILIES, Problem, RunEnd, Verdict, distance, norm};
use crate::parallel::parallel;
use contact_examples::Report;
use contact_examples::systems::HarmonicOscillator;
use contact_examples::{Failure, number};
use contact_geom::{PhasePoint, VelocityPoint, numbers::max_or_nan};

/// Exponents of two, for scales from 3e-151 to 3e150; their squares, the scales of z, are still normal numbers.
const EXPONENTS: [i32; 7] = [-500, -300, -100, 0, 100, 300, 500];

/// A late initial time.
const LATE_START: f64 = 1e9;

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let mut rows = Vec::new();
    states(report, &mut rows)?;
    tiny_steps(report, &mut rows)?;
    huge_steps(report, &mut rows)?;
    late_times(report, &mut rows)?;
    accuracies(report, &mut rows)?;
    report.table("", &["what", "integrator", "scale", "worth", "error"], rows)
}

fn row(what: &str, by: &str, scale: f64, verdict: &str, error: f64) -> Vec<String> {
    vec![what.into(), by.into(), number(scale), verdict.into(), number(error)]
}

/// A linear motion from a state that is scaled by a power of two is the scaled motion, digit by digit except for the
/// tolerances of solvers.
fn states(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    let of = |scale: f64| Problem {
        system: Formula::oscillator(-0.1),
        t0: 0.0,
        start: VelocityPoint::new([scale], [0.5 * scale], 0.25 * scale * scale),
        span: 8.0,
    };
    let mut worst = 0.0;
    for integrator in FAMILIES {
        let RunEnd::Completed(one) = of(1.0).by(integrator, 64) else {
            worst = f64::NAN;
            continue;
        };
        for power in EXPONENTS {
            let scale = 2f64.powi(power);
            let error = match of(scale).by(integrator, 64) {
                RunEnd::Completed(x) => {
                    let back = PhasePoint { q: x.q / scale, p: x.p / scale, z: x.z / scale / scale };
                    norm(&[back.q[0] - one.q[0], back.p[0] - one.p[0], back.z - one.z])
                }
                _ => f64::NAN,
            };
            rows.push(row("scaled_state", &integrator.to_string(), scale, "-", error));
            worst = max_or_nan(worst, error);
        }
    }
    // A few rounding errors in each of 64 steps.
    report.at_most("states scaled by 3e-151 .. 3e150: difference from the same motion unscaled", worst, 1e-13)
}

/// Steps so short that their increments are close to the round-off of the state; a sum of many must not lose them.
fn tiny_steps(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    let (mut worst, steps) = (0.0, 1000);
    for h in [1e-12, 1e-10, 1e-8, 1e-6] {
        let start = VelocityPoint::new([1.0], [0.7], 0.0);
        let problem = Problem { system: Formula::pendulum(-0.1), t0: 0.0, start, span: h * steps as f64 };
        let exact = problem.exact()?;
        for integrator in FAMILIES {
            let error = problem.by(integrator, steps).error(&exact, 0.0);
            rows.push(row("tiny_step", &integrator.to_string(), h, "-", error));
            // One rounding error per substep, with up to five substeps per step.
            worst = max_or_nan(worst, error);
        }
    }
    let bound = 2.0 * f64::EPSILON * (5.0 * steps as f64).sqrt();
    report.at_most("1000 steps of 1e-12 .. 1e-6: error, a random walk of roundings", worst, bound)
}

/// Steps that are too long for any method: a run must be right by chance or report a failure.
fn huge_steps(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    let mut tally = Tally::new();
    for (name, system) in [("oscillator", Formula::oscillator(-0.01)), ("pendulum", Formula::pendulum(-0.01))] {
        for (h, steps) in [3.0, 10.0, 30.0, 100.0, 1000.0].into_iter().flat_map(|h| [2, 5].map(|n| (h, n))) {
            let start = VelocityPoint::new([1.0], [1.0], 0.0);
            let problem = Problem { system, t0: 0.0, start, span: h * f64::from(steps) };
            let exact = problem.exact()?;
            for integrator in FAMILIES {
                let (verdict, error) = problem.verdict(integrator, steps as usize, &exact, 1.0);
                *tally.entry(verdict).or_default() += 1;
                rows.push(row(&format!("huge_step_{name}"), &integrator.to_string(), h, verdict.name(), error));
            }
        }
    }
    report.at_most("steps of 3 to 1000 time units: runs silently wrong", bad([&tally]), 0.0)
}

/// From t0 = 1e9, an autonomous motion is the same to the last digit, and a driven one is accurate to the rounding of
/// the time.
fn late_times(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    let start = VelocityPoint::new([1.0], [0.5], 0.0);
    let (mut moved, mut worst) = (0.0, 0.0);
    for integrator in FAMILIES {
        let early = Problem { system: Formula::pendulum(-0.1), t0: 0.0, start, span: 8.0 };
        let error = match (early.by(integrator, 64), Problem { t0: LATE_START, ..early }.by(integrator, 64)) {
            (RunEnd::Completed(a), RunEnd::Completed(b)) => distance(&b, &a, 0.0),
            _ => f64::NAN,
        };
        rows.push(row("late_autonomous", &integrator.to_string(), LATE_START, "-", error));
        moved = max_or_nan(moved, error);

        let force = Force::Swinging { size: 1.0, frequency: 0.5 };
        let system = Formula { force, ..Formula::pendulum(-0.1) };
        // Integrators of low order take finer steps.
        let problem = Problem { system, t0: LATE_START, start, span: 8.0 };
        let error =
            problem.by(integrator, if integrator.order() > 4 { 256 } else { 1 << 16 }).error(&problem.exact()?, 0.0);
        rows.push(row("late_driven", &integrator.to_string(), LATE_START, "-", error));
        worst = max_or_nan(worst, error);
    }
    report.at_most("autonomous motions from t0 = 1e9: difference from t0 = 0", moved, 0.0)?;
    // Times, and with them the phase of the drive, are rounded to eps t0.
    report.at_most("driven motions from t0 = 1e9: error", worst, 4.0 * f64::EPSILON * LATE_START)
}

/// A requested accuracy is kept for any size of the state and any length of the span.
fn accuracies(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    let gamma = -0.1;
    let sizes = [1e-300, 1e-200, 1e-160, 1e-100, 1e-10, 1.0, 1e10, 1e100, 1e150];
    let spans = [1e-12, 1e-6, 1e-3, 1.0, 30.0, 1e3];
    let cases: Vec<(f64, f64)> = sizes.into_iter().flat_map(|s| spans.map(|t| (s, t))).collect();
    let found = parallel(&report.bar, cases.len(), |i| {
        let (size, span) = cases[i];
        let start = VelocityPoint::new([size], [0.5 * size], 0.0);
        let problem = Problem { system: Formula::<1>::oscillator(gamma), t0: 0.0, start, span };
        let exact = HarmonicOscillator { gamma }.solution(span, &start);
        let exact = PhasePoint { q: exact.q, p: exact.v, z: exact.z };
        let end = problem.to(1e-9);
        // A subnormal number has fewer digits than requested, so that a refusal is right.
        let normal = norm(&[exact.q[0], exact.p[0]]) >= f64::MIN_POSITIVE;
        (end.verdict(&exact, 0.0, 1e-8), end.error(&exact, 0.0), normal)
    });
    let (mut tally, mut refused) = (Tally::new(), 0);
    for ((size, span), (verdict, error, normal)) in cases.iter().zip(&found) {
        *tally.entry(*verdict).or_default() += 1;
        refused += u32::from(*normal && matches!(verdict, Verdict::Refused | Verdict::Failed));
        rows.push(row(&format!("accuracy_over_{span:e}"), "chosen", *size, verdict.name(), *error));
    }
    // For a state of 1e-160 the action and the energy underflow, since they are squares; (q, p) do not.
    report.at_most("an oscillator of 1e-300 .. 1e150 over 1e-12 .. 1e3, to 1e-9: above 1e-8", bad([&tally]), 0.0)?;
    report.at_most(
        "an oscillator of 1e-300 .. 1e150 over 1e-12 .. 1e3, to 1e-9: refused although the end is a normal number",
        f64::from(refused),
        0.0,
    )
}
