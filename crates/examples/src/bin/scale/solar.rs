//! The outer solar system with linear drag over 1e4 years: run time against error, compared with REBOUND's IAS15.

use crate::peer::python;
use contact_examples::Report;
use contact_examples::systems::Bodies;
use contact_examples::{Failure, print};
use contact_geom::nalgebra::SVector;
use contact_geom::{PhasePoint, numbers::max_or_nan};
use discrete_herglotz::{Problem, SplittingScheme, Start, Stepper, StepperOptions, gauss::GaussStepper};
use sparse_herglotz::systems::OuterSolarSystem;
use sparse_herglotz::{SparseSplitting, SparseSystem, State};
use std::time::Instant;

/// Sun to Neptune.
const BODIES: usize = 5;

/// The coefficient of the drag in 1/day: over 1e4 years, momenta decay by the factor e^(-0.037).
const GAMMA: f64 = -1e-8;

/// A run: error in au, and time in seconds.
type Found = (f64, f64);

/// Runs of IAS15: the final positions of the finest run, and error and time of every run.
struct Peer {
    finest: Vec<f64>,
    runs: Vec<Found>,
}

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let years = if report.quick { 1000 } else { 10_000 };
    let days = 365.25 * years as f64;
    let system = OuterSolarSystem::system(BODIES, GAMMA)?;
    let scheme = SplittingScheme::SOFRONIOU_SPALETTA_10;
    let finest = motion(&system, &scheme, days, (days / 60.0).ceil() as usize)?.0;
    // The errors of each program are measured against the finest run of the other.
    let theirs = ias15(days, &finest)?;
    let exact = theirs.as_ref().map_or(&finest, |peer| &peer.finest);
    if theirs.is_some() {
        report.at_most("difference of the two finest runs, in au", distance(exact, &finest), 1e-9)?;
    }
    let mut ours: Vec<Found> = Vec::new();
    let schemes = [SplittingScheme::BLANES_MOAN_6, SplittingScheme::BLANES_CASAS_8, scheme];
    for scheme in &schemes {
        let mut errors: Vec<(f64, f64)> = Vec::new();
        for h in [400.0, 340.0, 290.0, 250.0, 210.0, 180.0, 150.0, 120.0] {
            let steps = (days / h).ceil() as usize;
            let (positions, seconds) = motion(&system, scheme, days, steps)?;
            let error = distance(&positions, exact);
            report.row(&format!("{} to {error:.0e} au", scheme.name()), steps, seconds, None)?;
            ours.push((error, seconds));
            errors.push((h, error));
        }
        // An error term proportional to the drag would be of lower order.
        let slope = match errors[..] {
            [_, _, (coarse, more), .., (fine, less), _, _, _] => (more / less).ln() / (coarse / fine).ln(),
            _ => f64::NAN,
        };
        let what = format!("order that {} loses by the drag", scheme.name());
        report.at_most(&what, f64::from(scheme.order()) - slope, 0.5)?;
    }
    // Five bodies are also a small system, to which Gauss collocation applies.
    for (stages, widths) in
        [(8, [1000.0, 800.0, 650.0, 520.0, 420.0, 340.0]), (16, [2200.0, 1900.0, 1600.0, 1300.0, 1100.0, 900.0])]
    {
        for h in widths {
            let steps = (days / h).ceil() as usize;
            let (positions, seconds) = collocation(stages, days, steps)?;
            let error = distance(&positions, exact);
            report.row(&format!("gauss_{stages} to {error:.0e} au"), steps, seconds, None)?;
            ours.push((error, seconds));
        }
    }
    let Some(theirs) = &theirs else {
        return print(
            "            REBOUND is not installed (python3 with the package rebound, and cc); the comparison is \
             skipped\n",
        );
    };
    for (error, seconds) in &theirs.runs {
        report.row(&format!("REBOUND's IAS15 to {error:.0e} au"), years, *seconds, None)?;
        // Errors below the difference of the two finest runs are round-off of either program.
        let level = max_or_nan(*error, distance(exact, &finest));
        let here = ours.iter().filter(|f| f.0 <= level).map(|f| f.1).fold(f64::INFINITY, f64::min);
        report.at_most(&format!("time to {error:.0e} au over IAS15's"), here / seconds, 0.5)?;
    }
    Ok(())
}

/// The final positions by contact Gauss collocation, and the run time in seconds.
fn collocation(stages: usize, days: f64, steps: usize) -> Result<(Vec<f64>, f64), Failure> {
    const N: usize = 3 * BODIES;
    let bodies = Bodies::<N>::new(|i| OuterSolarSystem::MASSES[i], OuterSolarSystem::G, GAMMA);
    let (q, v) = (OuterSolarSystem::positions(BODIES), OuterSolarSystem::velocities(BODIES));
    let p = SVector::<f64, N>::from_fn(|d, _| bodies.masses()[d] * v[d]);
    let (start, v) = (PhasePoint { q: SVector::from_column_slice(&q), p, z: 0.0 }, SVector::from_column_slice(&v));
    let problem = Problem::new(&bodies, 0.0, Start::Momentum(start, v))?;
    best_of_two(|| {
        let mut motion = GaussStepper::new(&problem, stages, days / steps as f64, StepperOptions::default())?;
        let clock = Instant::now();
        motion.advance(steps).map_err(|failure| Failure::from(failure.cause))?;
        Ok((motion.state().q.as_slice().to_vec(), clock.elapsed().as_secs_f64()))
    })
}

/// The faster of two runs; IAS15 is measured in the same way.
fn best_of_two(run: impl Fn() -> Result<(Vec<f64>, f64), Failure>) -> Result<(Vec<f64>, f64), Failure> {
    let (one, other) = (run()?, run()?);
    Ok(if one.1 <= other.1 { one } else { other })
}

/// The final positions by a splitting with compensated sums, and the run time in seconds.
fn motion(
    system: &SparseSystem,
    scheme: &SplittingScheme,
    days: f64,
    steps: usize,
) -> Result<(Vec<f64>, f64), Failure> {
    let (q, v) = (OuterSolarSystem::positions(BODIES), OuterSolarSystem::velocities(BODIES));
    // The action is not computed: the potential energies for it would be part of the measured time.
    let start = State { t: 0.0, q: &q, v: &v, z: None };
    best_of_two(|| {
        let motion = SparseSplitting::new(system, scheme, days / steps as f64, start)?;
        let mut motion = motion.compensated();
        let clock = Instant::now();
        let done = motion.advance(steps);
        let seconds = clock.elapsed().as_secs_f64();
        done.map_err(|failure| Failure::from(failure.cause))?;
        Ok((motion.state().q.to_vec(), seconds))
    })
}

/// The 2-norm of the difference of two vectors; NaN where their lengths differ, as for a program that ended early.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    if a.len() != b.len() {
        return f64::NAN;
    }
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// Runs of REBOUND's IAS15 with several tolerances: the final positions with the smallest tolerance, and the error of
/// each run against `exact`. `None` where REBOUND is not installed.
fn ias15(days: f64, exact: &[f64]) -> Result<Option<Peer>, Failure> {
    let mut input = format!("{:e}\n{GAMMA:e}\n{days:e}\n", OuterSolarSystem::G);
    for i in 0..BODIES {
        let [p, v] = [OuterSolarSystem::POSITIONS[i], OuterSolarSystem::VELOCITIES[i]];
        for x in [OuterSolarSystem::MASSES[i]].iter().chain(&p).chain(&v) {
            input += &format!("{x:e}\n");
        }
    }
    let Some(output) = python(include_str!("solar_ias15.py"), &input)? else { return Ok(None) };
    let runs: Vec<Vec<f64>> =
        output.lines().map(|line| line.split(' ').filter_map(|x| x.parse().ok()).collect()).collect();
    let positions = |run: &Vec<f64>| run.get(2..).unwrap_or(&[]).to_vec();
    let found = |run: &Vec<f64>| (distance(&positions(run), exact), run.get(1).copied().unwrap_or(f64::NAN));
    let finest = runs.last().map(positions).unwrap_or_default();
    Ok(Some(Peer { finest, runs: runs.iter().map(found).collect() }))
}
