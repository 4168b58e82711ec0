//! The problem, the integrator with its properties, its stepper, the table of splitting schemes, dense output,
//! interruption and the entries of a plan.

mod at_state;
pub(crate) mod check_claims;
pub(crate) mod dense_step;
pub(crate) mod integrator;
pub(crate) mod interrupt;
#[cfg(test)]
mod order_conditions;
pub(crate) mod plan_entry;
pub(crate) mod problem;
mod reset;
pub(crate) mod scheme;
pub(crate) mod stepper;

pub(crate) use at_state::{AtState, at_state};
pub use check_claims::{check_claims, check_unforced};
pub(crate) use check_claims::{check_kicks, depends_on_action, is_separable};
pub use dense_step::DenseStep;
pub use integrator::{BatchKernel, Integrator, MethodInfo, StepFormula, StepperOptions};
pub use interrupt::{INTERRUPTION, Interrupt};
pub use plan_entry::PlanEntry;
pub use problem::{Problem, Start};
pub use reset::{Piece, Reset};
pub use scheme::SplittingScheme;
pub use stepper::{StepFailure, Stepper, SuspectInterval};
