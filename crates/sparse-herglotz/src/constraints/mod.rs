//! Constraints of elements.

mod distance;
pub(crate) mod jacobian;
mod local_constraint;

pub use distance::{Distance, DistanceToPoint};
pub(crate) use jacobian::{ConstraintElements, ConstraintList};
pub use local_constraint::LocalConstraint;
