//! The flow of Herglotz' field to round-off: panels of Gauss collocation that follow the motion.

pub(crate) mod flow;
pub(crate) mod gauss;
pub(crate) mod panel;
