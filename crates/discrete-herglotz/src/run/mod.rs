//! Runs of a problem: planning, time stepping, checks and observers.

mod accuracy;
mod any_integrator;
pub(crate) mod at_rest;
mod builder;
mod checks;
pub(crate) mod discretization;
mod end_within_step;
mod findings;
mod integrate;
mod observers;
mod outcome;
mod plan;
mod planning;
mod request;
mod resolved_step;
mod resume_state;

pub use any_integrator::{AnyIntegrator, UnknownIntegrator};
pub use builder::Run;
pub(crate) use checks::energy::may_drift;
pub use checks::energy_drift::{EnergyDrift, EnergySample};
pub use observers::checkpoint::Checkpoint;
#[cfg(feature = "csv")]
pub use observers::csv_rows::CsvRows;
pub use observers::event::{Crossing, Event};
pub use observers::events::Events;
pub(crate) use observers::interruption::Interruption;
pub use observers::last_step::LastStep;
pub use observers::momentum::{MomentumDecay, MomentumRow};
pub use observers::observer::{Observer, Terminal};
pub use observers::output_request::{OutputRequest, RunInfo};
pub use observers::progress::Progress;
pub use observers::quotient::Quotient;
pub use observers::resets::Resets;
pub(crate) use observers::rows;
pub use observers::rows::{Row, Rows};
pub use observers::step_view::{StepView, Stop};
pub use outcome::Outcome;
pub use plan::Plan;
pub use request::{Steps, Until};
pub(crate) use resolved_step::ResolvedStep;
pub use resume_state::{CheckpointError, ResumeState};
