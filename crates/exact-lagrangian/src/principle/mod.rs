//! Herglotz' principle for curves, and the constrained system used in the proofs of the paper.

mod curve;
mod nonholonomic;
mod spline_curve;

pub use curve::{Curve, CurveAction, MotionCurve, VariedCurve, action, action_derivative};
pub use nonholonomic::{Chetaev, ExtendedMotion, ExtendedPoint, NonHolonomic};
pub use spline_curve::SplineCurve;
