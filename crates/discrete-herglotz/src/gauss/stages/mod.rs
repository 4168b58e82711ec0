//! The stages of a collocation step: their equations, and the iterations that solve them.

pub(crate) mod changes;
pub(crate) mod curvature;
pub(crate) mod damped_newton;
pub(crate) mod damping;
pub(crate) mod equations;
pub(crate) mod fixed_point;
pub(crate) mod increments;
pub(crate) mod lifted_equations;
pub(crate) mod mass_matrix;
pub(crate) mod position_newton;
pub(crate) mod product;
pub(crate) mod slope_newton;
pub(crate) mod stage_newton;
pub(crate) mod stage_values;
