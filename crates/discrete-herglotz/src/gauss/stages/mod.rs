//! The stages of a collocation step: their values in SIMD registers, their equations, and the iterations that solve
//! them.

pub(crate) mod applied_force;
pub(crate) mod damping;
pub(crate) mod equations;
pub(crate) mod fixed_point;
pub(crate) mod lagrangian_values;
pub(crate) mod mass_matrix;
pub(crate) mod parametrization;
pub(crate) mod position_newton;
pub(crate) mod simplified_newton;
