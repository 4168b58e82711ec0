//! A tour of runs: a user-defined Lagrangian is integrated and observed, and its motion is plotted.
//!
//! ```text
//! cargo run --release --bin discrete_herglotz_tour [-- --out DIR]
//! ```
//!
//! Integrates a star in a pulsating galaxy by the midpoint rule. Writes every fifth state (`star.csv`), and the orbit
//! beside the decay of the angular momentum (`star.svg`), into `--out`. Prints the final state, the smallest conformal
//! factor of a step, and the largest relative difference of the angular momentum from the product of the factors.
//!
//! Writes also how far the steps of a splitting are from the flows of their modified Hamiltonians `H~_k`, for the orders k
//! from 1 to 8 and for 14 step sizes h (`modified_hamiltonian.csv`, `.svg`): the defects fall as `h^(k+1)`, and the
//! smallest over k as `e^(-c/h)`.

mod modified;

use clap::Parser;
use contact_examples::{Axis, Curve, Directory, Failure, Line, Panel, draw_row, finish, number, print};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint, Scalar, Symmetry};
use discrete_herglotz::{
    AnyIntegrator, MomentumDecay, MomentumRow, Observer, Problem, Progress, Row, Rows, Status, StepView, Steps, Stop,
    Until, rules::Method,
};
use indicatif::ProgressBar;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

/// A star in a galaxy whose core pulsates, with a drag that grows with the action: the Lagrangian is nonlinear in z,
/// depends on time, and is symmetric under rotations. Dimensionless: velocities are in units of the circular velocity
/// at large radii.
struct Star;

impl Lagrangian<2> for Star {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let core = (t * 0.7).cos() * 0.05 + 0.2;
        let potential = (q.dot(q) + core * core).ln() * 0.5;
        v.dot(v) * 0.5 - potential - z * 0.005 - z * z * 0.001
    }
}

/// Integrates a user-defined Lagrangian, and writes its orbit and the decay of its angular momentum.
#[derive(Parser)]
struct Arguments {
    /// The directory for the tables and the figures; created where it does not exist.
    #[arg(long, value_name = "DIR", default_value = "out/discrete_herglotz_tour")]
    out: PathBuf,
}

/// The step, and the number of steps.
const RUN: (f64, usize) = (0.02, 3000);

fn main() -> ExitCode {
    finish(run(&Arguments::parse()))
}

/// The smallest conformal factor of a step.
struct SmallestFactor(f64);

impl Observer for SmallestFactor {
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.0 = self.0.min(at.sigma);
        ControlFlow::Continue(())
    }
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let out = Directory::create(&arguments.out)?;
    let (h, steps) = RUN;
    let problem = Problem::new(&Star, 0.0, PhasePoint::new([1.0, 0.0], [0.0, 0.7], 0.0))?;

    // The observers: every fifth state, a momentum with its prediction, the smallest conformal factor, and a progress
    // bar.
    let mut states = Rows::every(5)?;
    let mut momentum = MomentumDecay::new(Symmetry::<2>::rotation(0, 1)?);
    let mut factor = SmallestFactor(f64::INFINITY);
    let bar = ProgressBar::new(steps as u64);
    let mut progress = Progress::new(|part| bar.set_position((part * steps as f64) as u64));
    let end = problem
        .by(AnyIntegrator::Discrete(Method::Midpoint))
        .steps(Steps::Size(h))
        .observe(&mut states)
        .observe(&mut momentum)
        .observe(&mut factor)
        .observe(&mut progress)
        .run(Until::Steps(steps))?;
    bar.finish_and_clear();

    let smallest = factor.0;
    let (rows, momentum, status) = (states.rows, momentum.rows, end.status);
    write(&out, &rows, &momentum)?;
    let [long, short] = modified::write(&out)?;
    let defect = momentum.iter().map(MomentumRow::defect).fold(0.0, f64::max);
    print(&format!(
        "{steps} steps of h = {h}: {status}\n\
         state at t = {:.2}: q = ({:.6}, {:.6}), p = ({:.6}, {:.6}), z = {:.6}\n\
         smallest conformal factor of a step: {smallest:.9}\n\
         angular momentum: from {:.6} to {:.6}; relative deviation from the product of the factors at most \
         {defect:.1e}\n\
         modified Hamiltonians of a splitting: smallest defects {long:.1e} for h = 0.8 and {short:.1e} for h = 0.4\n\
         tables and figures are in {}\n",
        end.t,
        end.q[0],
        end.q[1],
        end.p[0],
        end.p[1],
        end.state().z,
        momentum.first().map_or(f64::NAN, |row| row.momentum),
        momentum.last().map_or(f64::NAN, |row| row.momentum),
        out.path().display()
    ))?;
    match status {
        Status::Completed => Ok(()),
        status => Err(Failure::run(format_args!("the run of the star ended early: {status}"))),
    }
}

/// Writes the orbit as a table, and as a figure beside the angular momentum.
fn write(out: &Directory, rows: &[Row], momentum: &[MomentumRow]) -> Result<(), Failure> {
    let entries = rows.iter().map(|x| [x.t, x.q[0], x.q[1], x.p[0], x.p[1]].into_iter().chain(x.z).map(number));
    out.table("star.csv", &["t", "q1", "q2", "p1", "p2", "z"], entries)?;
    let orbit = Panel::new(
        ("position q1 (dimensionless)", Axis::Linear(-1.5, 1.5, 0.5)),
        ("position q2 (dimensionless)", Axis::Linear(-1.0, 1.0, 0.5)),
        (0.0, 1.0),
        vec![Curve::unnamed(Line::Solid, rows.iter().map(|x| (x.q[0], x.q[1])))],
    );
    let decay = Panel::new(
        ("time t (dimensionless)", Axis::Linear(0.0, 60.0, 10.0)),
        ("momentum J (dimensionless)", Axis::Linear(0.0, 0.8, 0.2)),
        (0.4, 0.95),
        vec![
            Curve::new("angular momentum", Line::Solid, momentum.iter().map(|r| (r.t, r.momentum))),
            Curve::new("product of the factors", Line::Dashed, momentum.iter().map(|r| (r.t, r.predicted))),
        ],
    );
    out.text("star.svg", &draw_row(&[orbit, decay]))
}
