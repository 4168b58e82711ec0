//! Herglotz' principle for curves, and the constrained system that the paper proves its theorems with.

pub(crate) mod curve;
pub(crate) mod nonholonomic;
pub(crate) mod spline_curve;
