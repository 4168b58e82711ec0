//! The stages of a collocation step: their equations, and the iterations that solve them.

pub(crate) mod equations;
pub(crate) mod mass_matrix;
pub(crate) mod stage_newton;
