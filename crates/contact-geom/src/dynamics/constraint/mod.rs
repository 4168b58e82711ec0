//! Constraints on positions and on velocities, and motions under them.

mod field;
mod holonomic;
mod nonholonomic;
mod redundancy;

pub use field::{ConstrainedMotion, constrained_motion, nonholonomic_motion};
pub use holonomic::{Constraint, ConstraintDerivatives};
pub use nonholonomic::{Distribution, DistributionDerivatives};
pub use redundancy::{Redundancy, independent_rows, least_norm, restricted};
