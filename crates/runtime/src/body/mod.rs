//! A rigid body about a fixed point.

mod ensemble;
mod integrator;
mod momenta;
mod motion;
mod observer;
mod outcome;
mod plan;
mod resume_state;
mod run;
mod steps;
mod system;

pub use ensemble::{BodyEnsemble, BodyMember};
pub use motion::{BodyEvent, BodyMotion};
pub use outcome::BodyOutcome;
pub use resume_state::BodyResumeState;
pub use system::Body;
