//! Motions of Lagrangians whose formula and dimension are known at run time only.
//!
//! The libraries below this one are generic in the number of coordinates and in the Lagrangian. This crate has one type
//! for all formulas in 1 to 16 coordinates, for which the generic code is compiled once; formulas with more run by contact
//! Gauss collocation, which evaluates them at one point at a time. [`System`] is a formula with
//! its integrators, [`Motion`] a request for one motion, [`Ensemble`] for many, and [`BoundaryProblem`] for a path
//! between two ends. [`Lattice`], given by the formulas of a site and of a bond, and [`Bodies`] have more coordinates. [`Body`] is a
//! rigid body about a fixed point.
//!
//! Without the feature `full` (default) a program is a third of the size: it has formulas in 1 to 8 coordinates, of which some have additional ones at rest, and
//! neither derivatives, ensembles nor the theorems of a check, which are refused by [`RuntimeError::NotCompiled`].
//!
//! ```
//! use herglotz_runtime::{Column, Motion, Start, System, StepControl, OutputTimes};
//!
//! let pendulum = System::parse("theta'^2/2 + cos(theta) + gamma*z", &["theta"], &[("gamma", -0.1)])?;
//! let motion = Motion {
//!     rows: Some(OutputTimes::At((0..=10).map(f64::from).collect())),
//!     columns: vec![Column::Time, Column::parse("theta", pendulum.formula())?, Column::Energy],
//!     ..Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), 10.0, StepControl::Accuracy { error: 1e-10, by: None })
//! };
//! let (outcome, rows) = pendulum.record(&motion)?;
//! println!("{}: {rows:?}", outcome.status);
//! # Ok::<(), herglotz_runtime::RuntimeError>(())
//! ```

mod body;
mod body_resume_state;
mod catalogue;
mod check;
mod clock;
mod column;
mod compare;
mod ensemble;
mod error;
mod fit;
mod full;
mod geometry;
mod interrupt;
mod kernel;
mod lyapunov;
mod member_derivatives;
mod method;
mod modified;
mod outcome;
mod parameters;
mod path;
mod peer;
mod request;
mod sensitivity;
mod sparse;
mod system;

pub use body::{Body, BodyDerivatives, BodyEnsemble, BodyEvent, BodyMember, BodyMotion, BodyOutcome, BodyTorque};
pub use body_resume_state::BodyResumeState;
pub use catalogue::{CATALOGUE, CatalogueEntry};
pub use check::{Check, MAX_CONTACT_DEFECT, MomentumSample, NotContact, Sample, StatementResidual};
pub use column::{Column, velocity_name};
pub use compare::{Comparison, Work};
pub use discrete_herglotz::sensitivity::{EndCovector, Gradient, MotionState, StateDerivative};
pub use ensemble::{Ending, Ensemble, EnsembleMonitor, MemberEnd, Varied};
pub use error::{RuntimeError, in_words};
pub use fit::{FittedMotion, FittedSeries, MotionFit, Series, SignChanges, Unknown};
pub use geometry::{Geometry, HamiltonianGeometry};
pub use interrupt::Interrupt;
pub use lyapunov::LyapunovExponents;
pub use member_derivatives::BatchLoss;
pub use method::FormulaMethod;
pub use outcome::{AfterReset, Crossing, Outcome, Plan, RunMonitor};
pub use parameters::check_parameters;
pub use path::{BoundaryProblem, FoundPath};
pub use peer::{FirstOrder, Peer, PeerEnd};
pub use request::{Direction, Event, InitialVelocity, Motion, OutputTimes, Start, StepControl};
pub use sensitivity::{EventAt, Loss, LossGradient, Sensitivity};
pub use sparse::{Bodies, Boundary, Lattice, SiteMotion, SiteSystem, SumOfTerms};
pub use system::System;

pub use contact_geom::nalgebra::DMatrix;
pub use contact_geom::switching::Impact;
pub use contact_geom::table::{Interpolation, Table, TableError};
pub use contact_geom::{HamiltonianStructure, Statement, Structure};
pub use discrete_herglotz::groups::GroupStatus;
pub use discrete_herglotz::{
    AnyIntegrator, INTERRUPTION, InputError, MethodInfo, PlanEntry, ResumeState, SelectionFailure, Status, StepError,
    Steps, UnknownIntegrator, UnresolvedStep, boundary::PathStatus, ensemble::Tally, hamiltonian::ModifiedDefect,
};
pub use formula_lagrangian::{Direction as FormulaDirection, Friction, Reset as FormulaReset};
pub use formula_lagrangian::{Expression, Formula, FormulaError, FormulaNames, FormulaSymmetry, Graph, ParseError};
pub use formula_lagrangian::{Symbol, Symbols, nearest_name};
pub use herglotz_fit::{Bound, Fit, FitError, FitStatus, Loss as ResidualLoss};
