//! Exact discrete Lagrangians: `L_h^e(q0, q1, z0) = z(h) - z0`, the action along the motion from `q0` to `q1` in time `h`.
//!
//! Their discrete flow is the motion itself, sampled; every theorem on discrete Lagrangians holds for them, with
//! `sigma_d = e^(int L_z)`. So far the crate holds those that are known in closed form through a linear motion.
//!
//! ```
//! use contact_geom::DiscretePoint;
//! use discrete_herglotz::{DiscreteLagrangian, discrete_flow};
//! use exact_lagrangian::LinearExact;
//!
//! let ld = LinearExact::oscillator(-0.05, 0.5)?;
//! let x = DiscretePoint::new([0.0], [1.0], 0.0);
//! let next = discrete_flow(&ld, 0.0, &x)?; // (q(h), q(2h), z(h)), exactly
//! assert!((ld.jet(0.0, &x)?.sigma() - (-0.05f64 * 0.5).exp()).abs() < 1e-15);
//! # let _ = next;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod composition;
mod conjugate;
mod error;
mod exact_lagrangian;
mod exponential;
mod flow;
mod gauss;
mod linear_exact;
mod nonholonomic;
mod panel;
mod principle;
mod quadratic_exact;
mod retraction;
mod spline_curve;
pub mod statements;
mod variational_error;

pub use composition::{Composition, compose, through};
pub use conjugate::ConjugatePoint;
pub use error::ExactError;
pub use exact_lagrangian::ExactLagrangian;
pub use exponential::{ContactExponential, ExponentialDifferential, HerglotzFlow};
pub use flow::{Motion, PANELS, herglotz_flow};
pub use linear_exact::LinearExact;
pub use nonholonomic::{Chetaev, ExtendedMotion, ExtendedPoint, NonHolonomic};
pub use principle::{Curve, CurveAction, MotionCurve, VariedCurve, action, action_derivative};
pub use quadratic_exact::QuadraticExact;
pub use retraction::{Retraction, Route};
pub use spline_curve::SplineCurve;
pub use variational_error::{ErrorOrders, MeasuredOrder, error_orders};
