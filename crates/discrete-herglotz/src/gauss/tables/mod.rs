//! Coefficients of contact Gauss collocation, and the linear maps that each route derives from them once.

pub(crate) mod coefficients;
pub(crate) mod condensed;
pub(crate) mod modes;
pub(crate) mod stage_table;
