//! The quadrature rules for the action, one file each.

mod integrator;
mod left_midpoint;
mod midpoint;
mod rectangle;
mod trapezoidal;

pub use integrator::{ByRule, Composed, Discrete, Discretisation};
pub use left_midpoint::{LeftMidpoint, LeftMidpointRule};
pub use midpoint::{Midpoint, MidpointRule};
pub use rectangle::{Rectangle, RectangleRule};
pub use trapezoidal::{Trapezoidal, TrapezoidalRule};
