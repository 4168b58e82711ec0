//! Chains and nets of rigid rods: time of a step of RATTLE against the number of rods.

use crate::chain::refused;
use crate::memory::peak;
use crate::report::Report;
use crate::seconds::{best, done};
use contact_examples::Failure;
use discrete_herglotz::{SplittingScheme, constraints::OffConstraint};
use sparse_herglotz::systems::{RodChain, RodNet};
use sparse_herglotz::{SparseRattle, SparseSystem, State};

const CASE: &str = "rods";
const GAMMA: f64 = -0.1;
const GRAVITY: f64 = 9.81;
const H: f64 = 1e-3;

/// The run time in seconds of a step of a chain of 128 links by DART, from the table of peers: measured with another
/// program on a machine of this kind.
const DART: f64 = 2.66e-3;

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let sizes: &[usize] = if report.quick { &[8, 32, 128, 512] } else { &[8, 32, 128, 512, 2048, 8192] };
    let mut times = Vec::new();
    for &links in sizes {
        // Released from a line at an angle to the vertical. The waves of the longest chain are resolved by H.
        let rods = RodChain { links, length: 0.1, mass: 1.0, gravity: GRAVITY };
        let (seconds, bytes) = step(rods.system(GAMMA).map_err(refused)?, &rods.straight(0.5))?;
        report.row(CASE, "a step of a chain", links, seconds, Some(bytes));
        times.push((links as f64, seconds));
        if links == 128 {
            report.verdict(CASE, "seconds of a step of a chain of 128 links", seconds, 2e-4);
            report.verdict(CASE, "a step of a chain of 128 links over DART as tabulated", seconds / DART, 0.075);
        }
    }
    // From 32 links on, since the overhead of a step is not part of the growth.
    let growing: Vec<(f64, f64)> = times.into_iter().filter(|(links, _)| *links >= 32.0).collect();
    report.verdict(CASE, "log-log slope of the time of a step against the links", slope(&growing), 1.15);
    for side in if report.quick { [5, 10, 20] } else { [10, 30, 100] } {
        let rods = RodNet { size: [side, side], length: 0.1, mass: 1.0, gravity: GRAVITY };
        let links = side * (2 * side - 1);
        let (seconds, bytes) = step(rods.system(GAMMA).map_err(refused)?, &rods.hanging(0.5))?;
        report.row(CASE, "a step of a net", links, seconds, Some(bytes));
    }
    Ok(())
}

/// The time of a step, with its action, and the peak memory.
fn step(system: SparseSystem, q: &[f64]) -> Result<(f64, usize), Failure> {
    let v = vec![0.0; q.len()];
    let start = State { t: 0.0, q, v: &v, z: Some(0.0) };
    let (seconds, bytes) = peak(|| {
        let mut motion =
            SparseRattle::new(&system, &SplittingScheme::STRANG, H, start, OffConstraint::Refuse).map_err(refused)?;
        let steps = (100_000 / q.len()).clamp(4, 200);
        let mut failure = None;
        let seconds = best(3, || {
            if let Err(found) = motion.advance(steps) {
                failure = Some(found);
            }
            done(motion.state().z);
        });
        match failure {
            Some(failure) => Err(Failure::Exact(failure.to_string())),
            None => Ok(seconds / steps as f64),
        }
    });
    Ok((seconds?, bytes))
}

/// The slope of a least-squares fit to the logarithms.
fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let (mx, my) = logs.iter().fold((0.0, 0.0), |(a, b), (x, y)| (a + x / n, b + y / n));
    let product: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    product / logs.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>()
}
