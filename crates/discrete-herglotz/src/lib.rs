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
//! Symbols and their names in code are in the project's `NOTATION.md`.

#[cfg(test)]
mod coarse_tests;
mod composition;
mod discrete_lagrangian;
mod discretised;
mod error;
mod flow;
mod gauss;
mod lanes;
mod legendre;
#[cfg(test)]
mod many_coordinates;
mod method;
mod momentum;
mod newton;
mod path;
mod quadrature;
#[cfg(test)]
mod round_off_tests;
pub mod rules;
mod run;
mod solver;
mod splitting;
pub mod statements;
mod step_equations;
mod stepper;
mod unknowns;
mod verified;
mod watch;
#[cfg(test)]
mod watch_tests;

pub use composition::Composition;
pub use discrete_lagrangian::{DiscreteLagrangian, Transition, derived_jet, derived_second_jet};
pub use discretised::Discretised;
pub use error::{InputError, Obstacle, Status, StepError, Suspicion};
pub use flow::{
    Flow, FlowStep, HamiltonianFlow, discrete_flow, discrete_flow_jacobian, hamiltonian_flow, hamiltonian_flow_jacobian,
};
pub use gauss::{ClockedGauss, ClockedStepper, DenseStep, Gauss, GaussCollocation, GaussRoute, GaussStepper};
pub use legendre::{
    DiscreteRegularity, discrete_regularity, legendre_minus, legendre_minus_inverse, legendre_plus,
    legendre_plus_inverse, sigma_d,
};
pub use method::{Method, UnknownMethod};
pub use momentum::{MomentumDecay, MomentumRow, discrete_momentum, discrete_symmetry_defect};
pub use newton::{ITERATION_LIMIT, last_correction};
pub use path::{DiscretePath, discrete_action};
pub use quadrature::{ExtendedJet, Node, Quadrature, Rule};
pub use rules::{ByRule, Composed, Discrete, Discretisation, LeftMidpoint, Midpoint, Rectangle, Trapezoidal};
pub use run::{
    AnyIntegrator, Course, Crossing, Direction, Event, Events, Facts, Integrator, Item, LastStep, Moment, Needs,
    Observer, Outcome, Plan, Problem, Row, Rows, Run, Start, Steps, Stop, UnknownIntegrator, Until, Wants,
};
pub use solver::{CROSSOVER, Solver};
pub use splitting::{
    ActionFlow, ActionMap, ActionSplitting, ActionStrang, Riccati, RiccatiMap, Splitting, SplittingScheme, Strang,
};
pub use stepper::{Halt, Stepper};
pub use verified::verified;
pub use watch::Doubt;

pub use contact_geom;
