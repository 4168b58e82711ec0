//! Fits of motions: what is observed, its model, and multiple shooting.

pub(crate) mod motion_model;
pub(crate) mod multiple_shooting;
pub(crate) mod observed;
pub(crate) mod piecewise;
mod shooting_model;
pub(crate) mod tangent_rows;
