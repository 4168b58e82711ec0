//! Whether a collocation step resolves the motion: measures that need its stages or its polynomial.
//!
//! [`crate::resolution`] lists all measures and their thresholds.

pub(crate) mod defect_sample;
pub(crate) mod tail;
