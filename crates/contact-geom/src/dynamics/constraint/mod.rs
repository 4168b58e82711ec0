//! Constraints on positions and on velocities, and motions under them.

mod field;
mod holonomic;
mod nonholonomic;

pub use field::{ConstrainedMotion, constrained_motion};
pub use holonomic::{Constraint, ConstraintDerivatives};
pub use nonholonomic::{Distribution, DistributionDerivatives};
