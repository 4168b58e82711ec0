//! Damping and stiffness: a few steps of every family of integrators, over all ratios of the step to the time scales of
//! the motion.

use crate::formula::{Formula, Kinetic, Rate, Smooth};
use crate::motion::{FAMILIES, ORDER_ONE, Problem, RunEnd, Verdict, distance};
use crate::parallel::parallel;
use contact_examples::Report;
use contact_examples::systems::HarmonicOscillator;
use contact_examples::{Failure, number};
use contact_geom::nalgebra::SMatrix;
use contact_geom::{PhasePoint, VelocityPoint, numbers::max_or_nan};
use discrete_herglotz::{AnyIntegrator, SplittingScheme};
use std::collections::BTreeMap;

/// `gamma h`.
const DAMPINGS: [f64; 11] = [-1e6, -1e4, -1e2, -10.0, -1.0, -1e-3, 0.0, 1e-3, 1.0, 10.0, 50.0];

/// `k h^2`.
const STIFFNESSES: [f64; 11] = [1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 10.0, 1e2, 1e4, 1e8, 1e12];

/// The ratio of the second mass to the first.
const MASSES: [f64; 7] = [1e-14, 1e-9, 1e-4, 1.0, 1e4, 1e9, 1e14];

/// The steps of a run, each of length 1.
const STEPS: usize = 4;

/// The number of runs of each outcome.
pub type Tally = BTreeMap<Verdict, usize>;

/// The number of outcomes that must never occur.
pub fn bad<'a>(tallies: impl IntoIterator<Item = &'a Tally>) -> f64 {
    tallies.into_iter().flatten().filter(|(verdict, _)| verdict.is_failure()).map(|(_, count)| *count as f64).sum()
}

/// A table row of a tally: the counts of right, coarse, flagged, stopped, refused and bad runs.
pub fn row(name: String, tally: &Tally) -> Vec<String> {
    let count = |worths: &[Verdict]| worths.iter().filter_map(|w| tally.get(w)).sum::<usize>().to_string();
    vec![
        name,
        count(&[Verdict::Right]),
        count(&[Verdict::Coarse]),
        count(&[Verdict::Unresolved]),
        count(&[Verdict::Failed]),
        count(&[Verdict::Refused]),
        count(&[Verdict::Wrong, Verdict::NonFinite, Verdict::Panicked]),
    ]
}

/// The columns of [`row`], after the first.
pub const COLUMNS: [&str; 6] = ["right", "coarse", "marked", "halted", "refused", "silently wrong"];

/// The damped oscillator `q'' = -k q + gamma q'` in closed form, computed in units of its own time.
fn truth(gamma: f64, k: f64, t: f64, start: &VelocityPoint<1>) -> PhasePoint<1> {
    let w = k.sqrt();
    let scaled = VelocityPoint { v: start.v / w, ..*start };
    let end = HarmonicOscillator { gamma: gamma / w }.solution(t * w, &scaled);
    PhasePoint { q: end.q, p: end.v * w, z: end.z * w }
}

/// Expresses the position as a velocity, so that each coordinate counts by its energy.
fn in_velocities(x: &PhasePoint<1>, w: f64) -> PhasePoint<1> {
    PhasePoint { q: x.q * w, ..*x }
}

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let mut cases: Vec<(AnyIntegrator, bool, f64, f64)> = Vec::new();
    for integrator in FAMILIES {
        for (claims, gamma) in [true, false].into_iter().flat_map(|c| DAMPINGS.map(|g| (c, g))) {
            cases.extend(STIFFNESSES.map(|k| (integrator, claims, gamma, k)));
        }
    }
    let found = parallel(&report.bar, cases.len(), |i| {
        let (integrator, claims, gamma, k) = cases[i];
        let smooth = Smooth { spring: k, ..Smooth::default() };
        let system = Formula { smooth, ..Formula::<1>::oscillator(gamma) };
        let system = if claims { system } else { system.claiming_nothing() };
        let w = k.sqrt();
        let start = VelocityPoint::new([1.0 / w.max(1.0)], [0.5], 0.0);
        let problem = Problem { system, t0: 0.0, start, span: STEPS as f64 };
        let exact = in_velocities(&truth(gamma, k, STEPS as f64, &start), w);
        let end = match problem.by(integrator, STEPS) {
            RunEnd::Completed(x) => RunEnd::Completed(in_velocities(&x, w)),
            RunEnd::Unresolved(x) => RunEnd::Unresolved(in_velocities(&x, w)),
            other => other,
        };
        // The error of a decayed motion is relative to the initial state, since both solutions tend to zero.
        let scale = (start.q[0] * w).hypot(start.v[0]);
        (end.verdict(&exact, scale, ORDER_ONE), end.error(&exact, scale))
    });

    let mut tallies: BTreeMap<(usize, bool), Tally> = BTreeMap::new();
    let mut rows = Vec::new();
    for ((integrator, claims, gamma, k), (verdict, error)) in cases.iter().zip(&found) {
        let place = FAMILIES.iter().position(|i| i == integrator).unwrap_or(0);
        *tallies.entry((place, *claims)).or_default().entry(*verdict).or_default() += 1;
        let names = [integrator.to_string(), claims.to_string(), "1".into()];
        let numbers = [number(*gamma), number(*k), verdict.name().into(), number(*error)];
        rows.push(names.into_iter().chain(numbers).collect());
    }
    let name = |(place, claims): &(usize, bool)| {
        format!("{}, {}", FAMILIES[*place], if *claims { "claims" } else { "no claims" })
    };
    let columns: Vec<&str> = ["integrator"].into_iter().chain(COLUMNS).collect();
    report.markdown(&columns, tallies.iter().map(|(key, tally)| row(name(key), tally)));
    report.at_most(
        &format!("of {} runs of 4 steps, gamma h = -1e6 .. 50 and k h^2 = 1e-12 .. 1e12: silently wrong", cases.len()),
        bad(tallies.values()),
        0.0,
    )?;
    // The rate of the splitting is exact, so that a motion with drag and a very weak spring has a negligible error.
    let mut worst = 0.0;
    for ((integrator, claims, gamma, k), (verdict, error)) in cases.iter().zip(&found) {
        let exact = *integrator == AnyIntegrator::Splitting(SplittingScheme::STRANG);
        if exact && *claims && *k <= 1e-9 && *gamma <= 0.0 {
            worst = max_or_nan(worst, if *verdict == Verdict::Right { *error } else { f64::NAN });
        }
    }
    report.at_most("strang at k h^2 <= 1e-9, any damping: error (its rate is exact)", worst, 1e-8)?;
    masses(report, &mut rows)?;
    report.table("", &["integrator", "claims", "mass_ratio", "gamma_h", "k_h2", "worth", "error"], rows)
}

/// Two masses of very different size on equal springs, coupled through the mass matrix.
fn masses(report: &mut Report, rows: &mut Vec<Vec<String>>) -> Result<(), Failure> {
    let mut tally = Tally::new();
    let mut worst = 0.0;
    for ratio in MASSES {
        let coupled = 0.3 * ratio.min(1.0 / ratio).sqrt() * ratio.sqrt();
        let kinetic = Kinetic::Mass(SMatrix::from([[1.0, coupled], [coupled, ratio]]));
        let smooth = Smooth { spring: ratio.min(1.0), ..Smooth::default() };
        let system = Formula::<2> { kinetic, smooth, rate: Rate::Constant(-0.1), ..Formula::FREE };
        let start = VelocityPoint::new([1.0, 0.5], [0.0, 0.2], 0.0);
        let problem = Problem { system, t0: 0.0, start, span: 4.0 };
        let exact = problem.exact()?;
        for integrator in FAMILIES {
            let end = problem.by(integrator, 32);
            // Only positions are compared: momenta differ in size by the mass ratio.
            let positions = |x: &PhasePoint<2>| PhasePoint { p: x.p * 0.0, ..*x };
            let verdict = match &end {
                RunEnd::Completed(x) if distance(&positions(x), &positions(&exact), 0.0) <= ORDER_ONE => Verdict::Right,
                RunEnd::Completed(x) if distance(&positions(x), &positions(&exact), 0.0).is_nan() => Verdict::NonFinite,
                other => other.verdict(&exact, 0.0, ORDER_ONE),
            };
            let error = match &end {
                RunEnd::Completed(x) | RunEnd::Unresolved(x) => distance(&positions(x), &positions(&exact), 0.0),
                _ => f64::NAN,
            };
            if integrator.order() >= 16 {
                worst = max_or_nan(worst, error);
            }
            *tally.entry(verdict).or_default() += 1;
            let names = [integrator.to_string(), "true".into(), number(ratio)];
            rows.push(
                names.into_iter().chain(["-0.0125".into(), "-".into(), verdict.name().into(), number(error)]).collect(),
            );
        }
    }
    report.at_most("mass ratios 1e-14 .. 1e14: runs silently wrong", bad([&tally]), 0.0)?;
    // Accumulated rounding errors of positions of size one.
    report.at_most("mass ratios 1e-14 .. 1e14: error of Gauss with 8 and 16 stages", worst, 1e-12)
}
