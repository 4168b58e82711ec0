//! Discrete contact mechanics: discrete Lagrangians on Q x Q x R, their flows, and what the theory says of them.
//!
//! A discrete Lagrangian `L_d(q0, q1, z0)` advances the action by `z1 = z0 + L_d`; the discrete Herglotz equations
//! `D1 L_d(q1, q2, z1) + sigma_d D2 L_d(q0, q1, z0) = 0`, `sigma_d = 1 + Dz L_d`, advance the position. The flow on
//! T\*Q x R is conformally contact by construction: it contracts the contact form, and every momentum of a symmetry, by
//! exactly `sigma_d`. A [`Problem`] is a Lagrangian with a start; by an [`Integrator`] and some [`Steps`] it becomes a [`Run`], which
//! [`Observer`]s look at. A [`Method`](rules::Method) makes discrete Lagrangians from Lagrangians, [`statements`](theory::statements) checks the theory on them.
//!
//! ```
//! use contact_geom::{VelocityPoint, systems::DoublePendulum};
//! use discrete_herglotz::{GaussCollocation, Problem, Rows, Steps, Until};
//!
//! let system = DoublePendulum::default();
//! let problem = Problem::new(&system, 0.0, VelocityPoint::new([1.0, 0.5], [0.0, 0.0], 0.0))?;
//! let mut rows = Rows::at([0.5, 1.0, 1.5])?;
//! let run = problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.05)).observe(&mut rows);
//! let outcome = run.run(Until::Time(2.0))?;
//! println!("{}: {:?}, last {:?}", outcome.status, rows.rows, outcome.state());
//! # Ok::<(), discrete_herglotz::InputError>(())
//! ```
//!
//! Features: `faer` (default) for large linear systems, `csv` for rows written while a run goes on, `serde` for integrators by name.
//!
//! Symbols and their names in code are in the project's `NOTATION.md`.

pub mod boundary;
pub mod ensemble;
mod error;
pub mod gauss;
mod integration;
mod numbers;
mod resolution;
pub mod rules;
mod run;
pub mod solve;
pub mod splitting;
mod switching;
pub mod theory;

/// Checks of a motion for programs that take its steps themselves: claims of structure, the drift of the energy, suspect intervals, jumps of L.
pub mod checks {
    pub use crate::integration::{SuspectInterval, check_claims};
    pub use crate::run::{EnergyDrift, EnergyLook};
    pub use crate::switching::jumps_between;
}

pub use ensemble::builder::Ensemble;
pub use error::{InputError, SelectionFailure, Status, StepError, UnresolvedStep};
pub use gauss::integrator::{GaussCollocation, TransformedGauss};
pub use integration::{
    DenseStep, INTERRUPTION, Integrator, Interrupt, MethodInfo, PlanEntry, Problem, SplittingScheme, Start,
    StepFailure, Stepper, StepperOptions,
};
pub use rules::integrator::CustomMethod;
#[cfg(feature = "csv")]
pub use run::CsvRows;
pub use run::{
    AnyIntegrator, Checkpoint, CheckpointError, Crossing, Event, Events, LastStep, MomentumDecay, MomentumRow,
    Observer, Outcome, OutputRequest, Plan, Progress, Quotient, ResumeState, Row, Rows, Run, RunInfo, StepView, Steps,
    Stop, Terminal, UnknownIntegrator, Until,
};
pub use switching::DividedGauss;
pub use theory::discrete_lagrangian::{DiscreteLagrangian, DiscreteStep};

pub use contact_geom;
