//! A rigid body about a fixed point.

mod integrator;
mod motion;
mod run;
mod system;

pub use motion::{BodyEvent, BodyMotion};
pub use run::BodyOutcome;
pub use system::Body;
