//! A tour of the flow: a Lagrangian of one's own, run, observed and plotted.
//!
//! ```text
//! cargo run --release --bin discrete_herglotz_tour [-- --out DIR]
//! ```

use clap::Parser;
use contact_examples::{Axis, Curve, Directory, Failure, Line, Panel, draw_row, finish, number, print};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint, Scalar, Symmetry};
use discrete_herglotz::{Every, Flow, Midpoint, MomentumDecay, MomentumRow, Record, Status, Step};
use indicatif::ProgressBar;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

/// A star in a galaxy whose core pulsates, with a drag that grows with the action: nonlinear in z, driven in time, and still
/// symmetric under rotations. Dimensionless: velocities in units of the circular velocity far out.
struct Star;

impl Lagrangian<2> for Star {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let core = (t * 0.7).cos() * 0.05 + 0.2;
        let potential = (q.dot(q) + core * core).ln() * 0.5;
        v.dot(v) * 0.5 - potential - z * 0.005 - z * z * 0.001
    }
}

/// Runs a Lagrangian of one's own, and writes its orbit and the decay of its angular momentum.
#[derive(Parser)]
struct Arguments {
    /// The directory for the table and the figure; created where it does not exist.
    #[arg(long, value_name = "DIR", default_value = "out/discrete_herglotz_tour")]
    out: PathBuf,
}

/// The step, and the number of steps.
const RUN: (f64, usize) = (0.02, 3000);

fn main() -> ExitCode {
    finish(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let out = Directory::create(&arguments.out)?;
    let (h, steps) = RUN;
    let ld = Midpoint::new::<2>(Star, h)?;
    let mut flow = Flow::new(&ld, 0.0, PhasePoint::new([1.0, 0.0], [0.0, 0.7], 0.0))?;

    // What the run is observed by: every fifth state, a momentum with its prediction, the smallest conformal factor, a bar.
    let bar = ProgressBar::new(steps as u64);
    let progress = Every::new(100, |step: &Step<2>| {
        bar.set_position(step.k as u64);
        ControlFlow::Continue(())
    })?;
    let mut smallest = f64::INFINITY;
    let factor = |step: &Step<2>| {
        smallest = smallest.min(step.sigma);
        ControlFlow::Continue(())
    };
    let states = Every::new(5, Record::default())?;
    let momentum = MomentumDecay::new(Symmetry::rotation(0, 1)?);
    let mut observers = ((states, momentum), (factor, progress));
    let status = flow.run(steps, &mut observers)?;
    let ((states, momentum), _) = observers;
    bar.finish_and_clear();

    let (rows, momentum) = (states.into_inner().rows, momentum.rows);
    write(&out, &rows, &momentum)?;
    let defect = momentum.iter().map(MomentumRow::defect).fold(0.0, f64::max);
    let end = flow.state();
    print(&format!(
        "{steps} steps of h = {h}: {status}\n\
         state at t = {:.2}: q = ({:.6}, {:.6}), p = ({:.6}, {:.6}), z = {:.6}\n\
         smallest conformal factor of a step: {smallest:.9}\n\
         angular momentum: from {:.6} to {:.6}; at most {defect:.1e} (relative) from the product of the factors\n\
         table and figure are in {}\n",
        flow.time(),
        end.q[0],
        end.q[1],
        end.p[0],
        end.p[1],
        end.z,
        momentum.first().map_or(f64::NAN, |row| row.momentum),
        momentum.last().map_or(f64::NAN, |row| row.momentum),
        out.path().display()
    ))?;
    match status {
        Status::Completed => Ok(()),
        status => Err(Failure::Run { what: "the star", status }),
    }
}

/// The orbit as a table, and as a figure beside the angular momentum.
fn write(out: &Directory, rows: &[(f64, PhasePoint<2>)], momentum: &[MomentumRow]) -> Result<(), Failure> {
    let entries = rows.iter().map(|(t, x)| [*t, x.q[0], x.q[1], x.p[0], x.p[1], x.z].map(number));
    out.table("star.csv", &["t", "q1", "q2", "p1", "p2", "z"], entries)?;
    let orbit = Panel {
        x_label: "position q1 (dimensionless)".into(),
        y_label: "position q2 (dimensionless)".into(),
        x: Axis::Linear(-1.5, 1.5, 0.5),
        y: Axis::Linear(-1.0, 1.0, 0.5),
        legend: (0.0, 1.0),
        curves: vec![Curve::unnamed(Line::Solid, rows.iter().map(|(_, x)| (x.q[0], x.q[1])))],
        marks: Vec::new(),
    };
    let decay = Panel {
        x_label: "time t (dimensionless)".into(),
        y_label: "momentum J (dimensionless)".into(),
        x: Axis::Linear(0.0, 60.0, 10.0),
        y: Axis::Linear(0.0, 0.8, 0.2),
        legend: (0.4, 0.95),
        curves: vec![
            Curve::new("angular momentum", Line::Solid, momentum.iter().map(|r| (r.t, r.momentum))),
            Curve::new("product of the factors", Line::Dashed, momentum.iter().map(|r| (r.t, r.predicted))),
        ],
        marks: Vec::new(),
    };
    out.text("star.svg", &draw_row(&[orbit, decay]))
}
