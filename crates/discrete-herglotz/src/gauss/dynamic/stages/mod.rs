//! The stages of a collocation step with a number of coordinates that is known at run time.

pub(crate) mod position_newton;
pub(crate) mod product;
pub(crate) mod slope_newton;
pub(crate) mod stage_values;
