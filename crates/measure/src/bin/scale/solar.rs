//! The outer solar system with a drag over 1e4 years, beside REBOUND's IAS15.

use crate::chain::refused;
use crate::peer::python;
use crate::report::Report;
use assembled_herglotz::systems::OuterSolarSystem;
use assembled_herglotz::{AssembledSplitting, AssembledSystem, State};
use contact_examples::{Failure, print};
use discrete_herglotz::SplittingScheme;
use std::time::Instant;

const CASE: &str = "solar";

/// Sun to Neptune.
const BODIES: usize = 5;

/// The drag in 1/day: in 1e4 years momenta fall by the factor e^(-0.037).
const GAMMA: f64 = -1e-8;

/// A run: its error in au, its time in seconds.
type Found = (f64, f64);

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let years = if report.quick { 1000 } else { 10_000 };
    let days = 365.25 * years as f64;
    let system = OuterSolarSystem::system(BODIES, GAMMA).map_err(refused)?;
    let (scheme, finest) = (SplittingScheme::SOFRONIOU_SPALETTA_10, (days / 40.0).ceil() as usize);
    let exact = motion(&system, &scheme, days, finest)?.0;
    let mut ours: Vec<Found> = Vec::new();
    let schemes = [SplittingScheme::BLANES_MOAN_6, SplittingScheme::BLANES_CASAS_8, scheme];
    // Close enough for the fewest steps to an error to be among them, within a sixth or so.
    let widths = [400.0, 340.0, 290.0, 250.0, 210.0, 180.0, 150.0];
    for scheme in &schemes {
        let mut errors: Vec<(f64, f64)> = Vec::new();
        for h in widths {
            let steps = (days / h).ceil() as usize;
            let (positions, seconds) = motion(&system, scheme, days, steps)?;
            let error = distance(&positions, &exact);
            report.row(CASE, &format!("{} to {error:.0e} au", scheme.name()), steps, seconds, None);
            ours.push((error, seconds));
            errors.push((h, error));
        }
        // An error that is proportional to the drag would be of a lower order.
        let slope = match errors[..] {
            [_, _, (coarse, more), .., (fine, less), _, _] => (more / less).ln() / (coarse / fine).ln(),
            _ => f64::NAN,
        };
        let what = format!("order that {} loses by the drag", scheme.name());
        report.verdict(CASE, &what, f64::from(scheme.order()) - slope, 0.5);
    }
    let Some(theirs) = ias15(days, &exact)? else {
        return print(
            "            REBOUND is not there (python3 with the package rebound, and cc): nothing to compare with\n",
        );
    };
    for (error, seconds) in &theirs {
        report.row(CASE, &format!("REBOUND's IAS15 to {error:.0e} au"), years, *seconds, None);
        let here = ours.iter().filter(|f| f.0 <= *error).map(|f| f.1).fold(f64::INFINITY, f64::min);
        report.verdict(CASE, &format!("time to {error:.0e} au over IAS15's"), here / seconds, 0.5);
    }
    Ok(())
}

/// The positions at the end, and the seconds that they took.
fn motion(
    system: &AssembledSystem,
    scheme: &SplittingScheme,
    days: f64,
    steps: usize,
) -> Result<(Vec<f64>, f64), Failure> {
    let (q, v) = (OuterSolarSystem::positions(BODIES), OuterSolarSystem::velocities(BODIES));
    let start = State { t: 0.0, q: &q, v: &v, z: 0.0 };
    let mut motion = AssembledSplitting::new(system, scheme, days / steps as f64, start).map_err(refused)?;
    let clock = Instant::now();
    let done = motion.advance(steps);
    let seconds = clock.elapsed().as_secs_f64();
    done.map_err(|halt| Failure::Step(halt.cause))?;
    Ok((motion.state().q.to_vec(), seconds))
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// REBOUND's IAS15 at several tolerances; `None` where it is not installed.
fn ias15(days: f64, exact: &[f64]) -> Result<Option<Vec<Found>>, Failure> {
    let mut input = format!("{:e}\n{GAMMA:e}\n{days:e}\n", OuterSolarSystem::G);
    for i in 0..BODIES {
        let [p, v] = [OuterSolarSystem::POSITIONS[i], OuterSolarSystem::VELOCITIES[i]];
        for x in [OuterSolarSystem::MASSES[i]].iter().chain(&p).chain(&v) {
            input += &format!("{x:e}\n");
        }
    }
    let Some(output) = python(include_str!("solar_ias15.py"), &input)? else { return Ok(None) };
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split(' ').filter_map(|x| x.parse().ok()).collect();
        (distance(numbers.get(2..).unwrap_or(&[]), exact), numbers.get(1).copied().unwrap_or(f64::NAN))
    };
    Ok(Some(output.lines().map(row).collect()))
}
