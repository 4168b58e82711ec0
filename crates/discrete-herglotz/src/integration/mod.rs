//! The problem, the integrator with its properties, its stepper, the table of splitting schemes, dense output,
//! interruption and the entries of a plan.

mod at_state;
mod bound;
pub(crate) mod check_claims;
pub(crate) mod dense_step;
mod hermite;
pub(crate) mod integrator;
pub(crate) mod interrupt;
pub(crate) mod motion;
mod node;
mod of_typed;
#[cfg(test)]
mod order_conditions;
pub(crate) mod plan_entry;
pub(crate) mod problem;
mod quantity_derivatives;
mod reset;
mod run_support;
pub(crate) mod scheme;
mod solved_part;
mod solved_stages;
mod solved_step;
mod start_projection;
mod step_details;
pub(crate) mod stepper;
pub(crate) mod system_problem;

pub(crate) use at_state::{AtState, at_state};
pub(crate) use bound::{BoundIntegrator, SharedIntegrator, bound};
pub use check_claims::{check_claims, check_unforced};
pub(crate) use check_claims::{check_kicks, depends_on_action, force_defect, is_separable};
pub use dense_step::DenseStep;
pub(crate) use hermite::hermite;
pub use integrator::{BatchKernel, Integrator, MethodInfo, StepFormula, StepperOptions};
pub use interrupt::{INTERRUPTION, Interrupt};
pub(crate) use motion::Motion;
pub use node::Node;
pub(crate) use of_typed::OfTyped;
pub use plan_entry::PlanEntry;
pub use problem::{Problem, Start};
pub(crate) use quantity_derivatives::QuantityDerivatives;
pub use reset::{Piece, PieceStart, Reset};
pub use run_support::{RunSupport, SuspectInterval};
pub use scheme::SplittingScheme;
pub(crate) use solved_part::PartPoint;
pub use solved_part::{PartEnd, Passage, SolvedPart};
pub use solved_stages::SolvedStages;
pub(crate) use solved_stages::StageVectors;
pub(crate) use solved_step::{StepEnds, WholeStep};
pub use start_projection::StartProjection;
pub use step_details::StepDetails;
pub use stepper::{StepFailure, Stepper};
pub(crate) use system_problem::state_at;
pub use system_problem::{InitialState, SystemProblem};
