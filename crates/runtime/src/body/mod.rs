//! A rigid body about a fixed point.

mod between;
mod check;
mod columns;
mod derivatives;
mod ensemble;
mod integrator;
mod interruptible;
mod momenta;
mod motion;
mod observer;
mod outcome;
mod plan;
mod run;
mod steps;
mod system;
mod torque;

pub use derivatives::BodyDerivatives;
pub use ensemble::{BodyEnsemble, BodyMember};
pub use motion::{BodyEvent, BodyMotion};
pub use outcome::BodyOutcome;
pub use system::Body;
pub use torque::BodyTorque;
