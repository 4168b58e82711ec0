//! Rules: discrete Lagrangians from quadratures of the action (one file per rule), their flow, and compositions of it.

mod composition;
mod extended_path;
pub(crate) mod flow;
pub(crate) mod integrator;
mod left_midpoint;
mod method;
mod midpoint;
mod quadrature;
mod rectangle;
pub(crate) mod step_equations;
mod trapezoidal;

pub use crate::integration::Node;
pub use composition::Composition;
pub use flow::{Flow, FlowStep};
pub use integrator::{CompositionMethod, DiscretizationMethod, QuadratureMethod};
pub use left_midpoint::{LeftMidpoint, LeftMidpointRule};
pub use method::{AnyDiscreteLagrangian, Method, RuleVisitor, UnknownMethod};
pub use midpoint::{Midpoint, MidpointRule};
pub use quadrature::{ExtendedJet, Quadrature, Rule};
pub use rectangle::{Rectangle, RectangleRule};
pub use trapezoidal::{Trapezoidal, TrapezoidalRule};
