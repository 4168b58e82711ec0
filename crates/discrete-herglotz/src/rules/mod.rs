//! Rules: discrete Lagrangians from quadratures of the action, their flow, and compositions of it.

mod composition;
mod extended_path;
pub(crate) mod flow;
pub(crate) mod integrator;
mod method;
mod quadrature;
mod rule;
pub(crate) mod step_equations;

pub use crate::integration::Node;
pub use composition::Composition;
pub use flow::{Flow, FlowStep};
pub use integrator::{CompositionMethod, DiscretizationMethod};
pub use method::{AnyDiscreteLagrangian, Method, UnknownMethod};
pub use quadrature::{ExtendedJet, Quadrature};
pub use rule::Rule;
