//! What integrators are made of and for: the problem, the integrator with the facts about it, its stepper, the entries of a plan, the state
//! that is saved.

pub(crate) mod check_claims;
pub(crate) mod dense_step;
pub(crate) mod integrator;
pub(crate) mod interrupt;
#[cfg(test)]
mod order_conditions;
pub(crate) mod plan_entry;
pub(crate) mod problem;
pub(crate) mod scheme;
pub(crate) mod stepper;

pub use check_claims::check_claims;
pub use dense_step::DenseStep;
pub use integrator::{BatchKernel, Integrator, MethodInfo, StepperOptions};
pub use interrupt::{INTERRUPTION, Interrupt};
pub use plan_entry::PlanEntry;
pub use problem::{Problem, Start};
pub use scheme::SplittingScheme;
pub use stepper::{StepFailure, Stepper, SuspectInterval};
