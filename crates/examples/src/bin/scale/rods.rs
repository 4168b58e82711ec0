//! Chains and nets of rigid rods: time of a step of RATTLE against the number of rods, and the energy of a chain.

use crate::memory::peak;
use crate::seconds::{best, done};
use contact_examples::Report;
use contact_examples::{Failure, number};
use contact_geom::numbers::max_or_nan;
use discrete_herglotz::{SplittingScheme, constraints::OffConstraint};
use sparse_herglotz::systems::{RodChain, RodNet};
use sparse_herglotz::{SparseRattle, SparseSystem, State};
use std::time::Instant;

const GAMMA: f64 = -0.1;
const GRAVITY: f64 = 9.81;
const H: f64 = 1e-3;

pub fn run(report: &mut Report) -> Result<(), Failure> {
    let sizes: &[usize] = if report.quick { &[8, 32, 128, 512] } else { &[8, 32, 128, 512, 2048, 8192] };
    let mut times = Vec::new();
    for &links in sizes {
        // Released from a line at an angle to the vertical. The waves of the longest chain are resolved by H.
        let rods = RodChain { links, length: 0.1, mass: 1.0, gravity: GRAVITY };
        let (seconds, bytes) = step(rods.system(GAMMA)?, &rods.straight(0.5))?;
        report.row("a step of a chain", links, seconds, Some(bytes))?;
        times.push((links as f64, seconds));
        if links == 128 {
            report.at_most("seconds of a step of a chain of 128 links", seconds, 2e-4)?;
        }
    }
    // From 32 links on, since the overhead of a step is not part of the growth.
    let growing: Vec<(f64, f64)> = times.into_iter().filter(|(links, _)| *links >= 32.0).collect();
    report.at_most("log-log slope of the time of a step against the links", slope(&growing), 1.15)?;
    for side in if report.quick { [5, 10, 20] } else { [10, 30, 100] } {
        let rods = RodNet { size: [side, side], length: 0.1, mass: 1.0, gravity: GRAVITY };
        let links = side * (2 * side - 1);
        let (seconds, bytes) = step(rods.system(GAMMA)?, &rods.hanging(0.5))?;
        report.row("a step of a net", links, seconds, Some(bytes))?;
    }
    conserved(report)
}

/// Times, energy errors and ends of a chain of 128 links without drag, in a table. The benchmark
/// `chain_against_engines.py` of the Python package compares them with multibody programs.
fn conserved(report: &mut Report) -> Result<(), Failure> {
    let rods = RodChain { links: 128, length: 0.1, mass: 1.0, gravity: GRAVITY };
    let (system, q) = (rods.system(0.0)?, rods.straight(0.5));
    let ways = [
        ("strang", SplittingScheme::STRANG, 4e-3),
        ("strang", SplittingScheme::STRANG, 2e-3),
        ("strang", SplittingScheme::STRANG, 1e-3),
        ("suzuki_4", SplittingScheme::SUZUKI_4, 4e-3),
        ("suzuki_4", SplittingScheme::SUZUKI_4, 2e-3),
        ("kahan_li_8", SplittingScheme::KAHAN_LI_8, 4e-3),
    ];
    let mut rows = Vec::new();
    for (name, scheme, h) in ways {
        let run = swing(&rods, &system, &scheme, h, &q)?;
        report.row(&format!("a step without drag, {name}, h = {h}"), rods.links, run.seconds, None)?;
        let figures = [h, run.seconds, run.energy_error, run.tip[0], run.tip[1]];
        rows.push(std::iter::once(name.into()).chain(figures.map(number)).collect());
    }
    report.table("energy", &["scheme", "h", "seconds", "energy_error", "tip_x", "tip_y"], rows)
}

/// A swing of the chain over [`SWING`] time units.
struct Swing {
    /// The run time of a step in seconds, by the sum of the shortest times of each part over repeated runs: a part is
    /// short enough to run without interruption now and then.
    seconds: f64,
    /// The largest error of the energy after the parts, relative to the energy that the chain can release.
    energy_error: f64,
    /// The position of the last mass at the end.
    tip: [f64; 2],
}

/// The time of a swing, and the number of its parts.
const SWING: f64 = 2.0;
const PARTS: usize = 100;

fn swing(
    rods: &RodChain,
    system: &SparseSystem,
    scheme: &SplittingScheme,
    h: f64,
    q: &[f64],
) -> Result<Swing, Failure> {
    let v = vec![0.0; q.len()];
    let start = State { t: 0.0, q, v: &v, z: None };
    let energy = |state: &State| {
        let kinetic: f64 = state.v.iter().map(|v| 0.5 * rods.mass * v * v).sum();
        kinetic + state.q.iter().skip(1).step_by(2).map(|y| rods.mass * rods.gravity * y).sum::<f64>()
    };
    let bottom = rods.straight(0.0);
    let released = energy(&start) - energy(&State { q: &bottom, ..start });
    let steps = (SWING / h).round() as usize / PARTS;
    let (mut least, mut energy_error, mut tip) = ([f64::INFINITY; PARTS], 0.0, [f64::NAN; 2]);
    for _ in 0..5 {
        let mut motion = SparseRattle::new(system, scheme, h, start, OffConstraint::Refuse)?;
        for least in &mut least {
            let clock = Instant::now();
            motion.advance(steps).map_err(Failure::motion)?;
            *least = least.min(clock.elapsed().as_secs_f64());
            energy_error = max_or_nan(energy_error, ((energy(&motion.state()) - energy(&start)) / released).abs());
        }
        tip = motion.state().q.last_chunk().copied().unwrap_or(tip);
    }
    let seconds = least.iter().sum::<f64>() / (PARTS * steps) as f64;
    Ok(Swing { seconds, energy_error, tip })
}

/// The time of a step, with its action, and the peak memory.
fn step(system: SparseSystem, q: &[f64]) -> Result<(f64, usize), Failure> {
    let v = vec![0.0; q.len()];
    let start = State { t: 0.0, q, v: &v, z: Some(0.0) };
    let (seconds, bytes) = peak(|| {
        let mut motion = SparseRattle::new(&system, &SplittingScheme::STRANG, H, start, OffConstraint::Refuse)?;
        let steps = (100_000 / q.len()).clamp(4, 200);
        let mut failure = None;
        let seconds = best(3, || {
            if let Err(found) = motion.advance(steps) {
                failure = Some(found);
            }
            done(motion.state().z);
        });
        match failure {
            Some(failure) => Err(Failure::motion(failure)),
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
