//! The flow of the Herglotz vector field to round-off, by Gauss collocation on panels that adapt to the motion.

pub(crate) mod flow;
pub(crate) mod gauss;
pub(crate) mod panel;
