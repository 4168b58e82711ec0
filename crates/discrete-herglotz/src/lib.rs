//! Discrete contact mechanics: discrete Lagrangians on Q x Q x R, their flows, and numerical checks of the theory.
//!
//! A discrete Lagrangian `L_d(q0, q1, z0)` advances the action by `z1 = z0 + L_d`; the discrete Herglotz equations
//! `D1 L_d(q1, q2, z1) + sigma_d D2 L_d(q0, q1, z0) = 0`, `sigma_d = 1 + Dz L_d`, advance the position. The flow on
//! T\*Q x R is conformally contact by construction: it scales the contact form, and the momentum of every symmetry, by
//! exactly `sigma_d`.
//!
//! A [`Problem`] is a Lagrangian with an initial state. With an [`Integrator`] and a choice of [`Steps`] it becomes a
//! [`Run`], whose output goes to [`Observer`]s. A [`Method`](rules::Method) constructs a discrete Lagrangian from a
//! Lagrangian; [`statements`] evaluates the statements of the paper for a discrete Lagrangian.
//!
//! ```
//! use contact_examples::systems::DoublePendulum;
//! use contact_geom::VelocityPoint;
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
//! Features: `faer` (default) for large linear systems, `csv` for writing rows during a run, `serde` for integrators by
//! name.
//!
//! The project's `NOTATION.md` lists the symbols and their names in code.

pub mod boundary;
pub mod constraints;
pub mod ensemble;
mod error;
pub mod gauss;
pub mod groups;
pub mod hamiltonian;
mod integration;
mod numbers;
mod resolution;
pub mod rules;
mod run;
pub mod sensitivity;
pub mod solve;
pub mod splitting;
pub mod statements;
mod status;
mod switching;
mod system;
#[cfg(test)]
mod test_lagrangians;
pub mod theory;

/// Checks of a motion for programs that advance a stepper themselves: the claimed structure of L, the energy drift,
/// suspect intervals, and jumps of L.
pub mod checks {
    pub use crate::integration::{SuspectInterval, check_claims, check_unforced};
    pub use crate::run::{EnergyDrift, EnergySample};
    pub use crate::switching::jumps_between;
}

/// Tools for the other crates of this project: the flow of the kinetic part with a linear drag, compensated
/// summation, items in order.
pub mod support {
    pub use crate::numbers::compensated::exact_sum;
    pub use crate::numbers::order::sorted;
    pub use crate::splitting::drag::Drift;
}

pub use ensemble::builder::Ensemble;
pub use error::{InputError, SelectionFailure, StepError};

pub use gauss::integrator::{GaussCollocation, TransformedGauss};
pub use integration::{
    DenseStep, INTERRUPTION, InitialState, Integrator, Interrupt, MethodInfo, Piece, PieceStart, PlanEntry, Problem,
    Reset, RunSupport, SplittingScheme, Start, StartProjection, StepDetails, StepFailure, StepFormula, Stepper,
    StepperOptions, SystemProblem,
};
pub use rules::integrator::CustomMethod;
#[cfg(feature = "csv")]
pub use run::CsvRows;
pub use run::{
    AnyIntegrator, Checkpoint, CheckpointError, Crossing, Event, Events, LastStep, MomentumDecay, MomentumRow,
    Observer, Outcome, OutputRequest, Plan, Progress, Quotient, Resets, ResumeState, Row, Rows, Run, RunInfo, StepView,
    Steps, Stop, Terminal, UnknownIntegrator, Until,
};
pub use status::{Status, UnresolvedStep};
pub use switching::DividedGauss;
pub use system::{
    AtState, AtSwitch, Components, ExplicitDerivatives, ForceDerivatives, ForceKind, Kernels, Point, Quantity,
    SecondDerivatives, State, System, TypedSystem, Vector,
};
pub use theory::discrete_lagrangian::{DiscreteLagrangian, DiscreteStep};

pub use contact_geom;
