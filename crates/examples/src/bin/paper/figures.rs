//! The paper's six figures.

use crate::published::{PublishedRow, faulty_action};
use crate::series::{GAMMA, Row, STEP, true_start};
use contact_examples::systems::HarmonicOscillator;
use contact_examples::{Axis, Curve, Directory, Failure, Line, Panel, draw};
use contact_geom::VelocityPoint;

const TIME: &str = "time t (dimensionless)";
const POSITION: &str = "position q (dimensionless)";
const ACTION: &str = "action z (dimensionless)";
const ENERGY: &str = "ln H (H dimensionless)";

/// The discrete curve of an entry.
fn discrete(rows: &[Row], entry: fn(&Row) -> f64) -> Curve {
    Curve::new("discrete", Line::Solid, rows.iter().map(|r| (r.t, entry(r))))
}

/// The true curve.
fn exact(points: impl IntoIterator<Item = (f64, f64)>) -> Curve {
    Curve::new("exact", Line::Dashed, points)
}

/// What the paper plots in its place.
fn as_published(points: impl IntoIterator<Item = (f64, f64)>) -> Curve {
    Curve::new("exact as published", Line::Dotted, points)
}

fn panel(label: &str, x: Axis, y: Axis, legend: (f64, f64), curves: Vec<Curve>) -> Panel {
    Panel::new((TIME, x), (label, y), legend, curves)
}

/// The entries that a figure's discrete, exact and published curves show.
type Entries = (fn(&Row) -> f64, fn(&Row) -> f64, fn(&PublishedRow) -> f64);

/// Position, action and energy of the free particle.
pub fn free_particle(out: &Directory, rows: &[Row], published: &[PublishedRow]) -> Result<(), Failure> {
    let figure = |name: &str, label, y, legend, (solid, dashed, dotted): Entries| {
        let curves = vec![
            discrete(rows, solid),
            exact(rows.iter().map(|r| (r.t, dashed(r)))),
            as_published(published.iter().map(|r| (r.t, dotted(r)))),
        ];
        out.text(name, &draw(&panel(label, Axis::Linear(0.0, 50.0, 10.0), y, legend, curves)))
    };
    let (below, above) = ((0.5, 0.35), (0.5, 0.95));
    let q = Axis::Linear(0.0, 40.0, 10.0);
    figure("free_particle_q.svg", POSITION, q, below, (|r| r.q, |r| r.q_exact, |r| r.q))?;
    let z = Axis::Linear(0.0, 12.0, 2.0);
    figure("free_particle_z.svg", ACTION, z, above, (|r| r.z, |r| r.z_exact, |r| r.z))?;
    let h = Axis::Linear(-2.0, 1.0, 0.5);
    let entries: Entries = (|r| r.log_energy_midpoint, |r| r.log_hamiltonian_exact, |r| r.log_hamiltonian);
    figure("free_particle_log_hamiltonian.svg", ENERGY, h, above, entries)
}

/// Position, action and energy of the harmonic oscillator. Only the published action is wrong. The curves that are known
/// at all times are drawn smooth, the discrete ones with their points.
pub fn harmonic_oscillator(out: &Directory, rows: &[Row]) -> Result<(), Failure> {
    let system = HarmonicOscillator { gamma: GAMMA };
    let start = true_start(&system)?;
    // Ten points a step.
    let times = |end: usize| (0..=10 * end).map(|k| 0.1 * STEP * k as f64);
    let fine = || times(rows.len().saturating_sub(1));
    let motion =
        |entry: fn(&VelocityPoint<1>) -> f64| exact(fine().map(move |t| (t, entry(&system.solution(t, &start)))));
    let figure = |name: &str, label, y, legend, entry: fn(&Row) -> f64, others: Vec<Curve>| {
        let curves = std::iter::once(discrete(rows, entry)).chain(others).collect();
        let mut panel = panel(label, Axis::Linear(0.0, 25.0, 5.0), y, legend, curves);
        panel.marks = rows.iter().map(|r| (r.t, entry(r))).collect();
        out.text(name, &draw(&panel))
    };
    let (few, three) = ((0.65, 0.95), (0.5, 0.95));
    let q = Axis::Linear(-2.0, 3.0, 1.0);
    figure("harmonic_oscillator_q.svg", POSITION, q, few, |r| r.q, vec![motion(|x| x.q[0])])?;
    let z = Axis::Linear(-1.5, 2.0, 0.5);
    let faulty = as_published(fine().map(|t| (t, faulty_action(start.v[0], t))));
    figure("harmonic_oscillator_z.svg", ACTION, z, three, |r| r.z, vec![motion(|x| x.z), faulty])?;
    let h = Axis::Linear(-0.5, 1.0, 0.5);
    let truth = exact(rows.iter().map(|r| (r.t, r.log_hamiltonian_exact)));
    figure("harmonic_oscillator_log_hamiltonian.svg", ENERGY, h, few, |r| r.log_energy_midpoint, vec![truth])
}
