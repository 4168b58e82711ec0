//! Discrete contact mechanics: discrete Lagrangians on Q x Q x R, their flows, and what the theory says of them.
//!
//! A discrete Lagrangian `L_d(q0, q1, z0)` advances the action by `z1 = z0 + L_d`; the discrete Herglotz equations
//! `D1 L_d(q1, q2, z1) + sigma_d D2 L_d(q0, q1, z0) = 0`, `sigma_d = 1 + Dz L_d`, advance the position. The flow on
//! T\*Q x R is conformally contact by construction: it contracts the contact form, and every momentum of a symmetry, by
//! exactly `sigma_d`. A [`Problem`] is a Lagrangian with a start; by an [`Integrator`] and some [`Steps`] it becomes a [`Run`], which
//! [`Observer`]s look at. A [`Method`] makes discrete Lagrangians from Lagrangians, [`statements`] checks the theory on them.
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

mod boundary;
mod ensemble;
mod error;
mod gauss;
mod integration;
mod numbers;
mod resolution;
pub mod rules;
mod run;
mod solve;
mod splitting;
mod switching;
mod theory;

pub use boundary::{BoundaryPath, CriticalPath, End, PathStatus, branch, continuation};
pub use ensemble::{Ending, Ensemble, EnsembleError, Member, Merge, ObservedEnsemble, ShardedEnsemble, Tally};
pub use error::{InputError, SelectionFailure, Status, StepError, UnresolvedStep};
pub use gauss::{Gauss, GaussCollocation, GaussRoute, GaussStepper, TransformedGauss, TransformedStepper};
pub use integration::{
    BatchKernel, DenseStep, INTERRUPTION, Integrator, Interrupt, MethodInfo, PlanEntry, Problem, SplittingScheme,
    Start, StepFailure, Stepper, StepperOptions, SuspectInterval, check_claims,
};
pub use rules::*;
#[cfg(feature = "csv")]
pub use run::CsvRows;
pub use run::{
    AnyIntegrator, Checkpoint, CheckpointError, Crossing, EnergyDrift, EnergyLook, Event, Events, LastStep,
    MomentumDecay, MomentumRow, Observer, Outcome, OutputRequest, Plan, Progress, Quotient, ResumeState, Row, Rows,
    Run, RunInfo, StepView, Steps, Stop, Terminal, UnknownIntegrator, Until,
};
pub use solve::{CROSSOVER, ITERATION_LIMIT, Solver, last_correction};
pub use splitting::{ActionFlow, ActionMap, ActionSplitting, ActionStrang, Riccati, RiccatiMap, Splitting, Strang};
pub use switching::{DividedGauss, jumps_between};
pub use theory::{
    DiscreteLagrangian, DiscretePath, DiscreteRegularity, DiscreteStep, HamiltonianFlow, derived_jet,
    derived_second_jet, discrete_action, discrete_flow, discrete_flow_jacobian, discrete_momentum, discrete_regularity,
    discrete_symmetry_defect, hamiltonian_flow, hamiltonian_flow_jacobian, legendre_inverse, legendre_minus,
    legendre_minus_inverse, legendre_plus, legendre_plus_inverse, sigma_d, statements,
};

pub use contact_geom;
