//! The paper's six figures.

use crate::published::PublishedRow;
use crate::series::Row;
use contact_examples::{Axis, Curve, Directory, Failure, Legend, Line, Panel, draw};

const TIME: &str = "time t (dimensionless)";
const POSITION: &str = "position q (dimensionless)";
const ACTION: &str = "action z (dimensionless)";
const ENERGY: &str = "ln H (H dimensionless)";

/// The curves of one figure.
struct Curves<'a> {
    rows: &'a [Row],
    published: &'a [PublishedRow],
}

impl Curves<'_> {
    fn discrete(&self, entry: fn(&Row) -> f64) -> Curve {
        Curve::new("discrete", Line::Solid, self.rows.iter().map(|r| (r.t, entry(r))).collect())
    }

    fn exact(&self, entry: fn(&Row) -> f64) -> Curve {
        Curve::new("exact", Line::Dashed, self.rows.iter().map(|r| (r.t, entry(r))).collect())
    }

    fn as_published(&self, entry: fn(&PublishedRow) -> f64) -> Curve {
        let points = self.published.iter().map(|r| (r.t, entry(r))).collect();
        Curve::new("exact as published", Line::Dotted, points)
    }
}

fn panel(label: &str, x: Axis, y: Axis, legend: Legend, curves: Vec<Curve>) -> Panel {
    Panel { x_label: TIME.into(), y_label: label.into(), x, y, legend, curves, marks: Vec::new() }
}

/// Position, action and energy of the free particle.
pub fn free_particle(out: &Directory, rows: &[Row], published: &[PublishedRow]) -> Result<(), Failure> {
    let c = Curves { rows, published };
    let time = Axis::Linear(0.0, 50.0, 10.0);
    let q = vec![c.as_published(|r| r.q), c.discrete(|r| r.q), c.exact(|r| r.q_exact)];
    let z = vec![c.as_published(|r| r.z), c.discrete(|r| r.z), c.exact(|r| r.z_exact)];
    let h = vec![
        c.as_published(|r| r.log_hamiltonian),
        c.discrete(|r| r.log_energy_midpoint),
        c.exact(|r| r.log_hamiltonian_exact),
    ];
    let position = panel(POSITION, time, Axis::Linear(0.0, 40.0, 10.0), Legend::BottomRight, q);
    let action = panel(ACTION, time, Axis::Linear(0.0, 12.0, 2.0), Legend::TopRight, z);
    let energy = panel(ENERGY, time, Axis::Linear(-2.0, 1.0, 0.5), Legend::TopRight, h);
    out.text("free_particle_q.svg", &draw(&position))?;
    out.text("free_particle_z.svg", &draw(&action))?;
    out.text("free_particle_log_hamiltonian.svg", &draw(&energy))
}

/// Position, action and energy of the harmonic oscillator. Only the published action is wrong.
pub fn harmonic_oscillator(out: &Directory, rows: &[Row], published: &[PublishedRow]) -> Result<(), Failure> {
    let c = Curves { rows, published };
    let time = Axis::Linear(0.0, 25.0, 5.0);
    let q = vec![c.discrete(|r| r.q), c.exact(|r| r.q_exact)];
    let z = vec![c.as_published(|r| r.z), c.discrete(|r| r.z), c.exact(|r| r.z_exact)];
    let h = vec![c.discrete(|r| r.log_energy_midpoint), c.exact(|r| r.log_hamiltonian_exact)];
    let position = panel(POSITION, time, Axis::Linear(-2.0, 3.0, 1.0), Legend::TopRight, q);
    let action = panel(ACTION, time, Axis::Linear(-1.0, 2.0, 0.5), Legend::TopRight, z);
    let energy = panel(ENERGY, time, Axis::Linear(-0.5, 1.0, 0.5), Legend::TopRight, h);
    out.text("harmonic_oscillator_q.svg", &draw(&position))?;
    out.text("harmonic_oscillator_z.svg", &draw(&action))?;
    out.text("harmonic_oscillator_log_hamiltonian.svg", &draw(&energy))
}
