//! Constraints of elements, and the motions on them.

mod distance;
mod gram;
mod jacobian;
mod local_constraint;
mod rattle;
mod solver;
mod start;

pub use distance::{Distance, DistanceToPoint};
pub(crate) use jacobian::{ConstraintElements, ConstraintList};
pub use local_constraint::LocalConstraint;
pub use rattle::SparseRattle;
