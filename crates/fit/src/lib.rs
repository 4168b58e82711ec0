//! Fits of motions to data, and nonlinear least squares.
//!
//! [`LeastSquares`] minimises `1/2 sum_i C^2 rho((r_i/C)^2)`, `r_i = w_i (model_i(theta) - y_i)`, by the method of
//! Levenberg and Marquardt with exact Jacobians: with weights or standard deviations of the data, bounds of the
//! parameters, robust losses, and several starts. A [`Fit`] has the parameters with their covariance, and says which
//! combinations of parameters the data do not determine.
//!
//! ```
//! use herglotz_fit::{Curve, LeastSquares, Loss};
//! let x = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0];
//! let y = [2.01, 1.22, 0.73, 0.46, 9.99, 0.16, 0.1]; // with an outlier
//! let decay = Curve::new(["amplitude", "rate"], x, |x, theta, gradient| {
//!     let e = (-theta[1] * x).exp();
//!     gradient.copy_from_slice(&[e, -theta[0] * x * e]);
//!     theta[0] * e
//! });
//! let fit = LeastSquares::new(&decay, &y)?.bounds("rate", 0.0, 10.0)?.loss(Loss::Cauchy { scale: 0.02 })?.solve(&[1.0, 0.5])?;
//! println!("{fit}");
//! assert!((fit.parameters[1] - 1.0).abs() < 0.02);
//! # Ok::<(), herglotz_fit::FitError>(())
//! ```

mod bounds;
mod covariance;
mod curve;
mod differences;
mod error;
mod fit;
mod function_model;
mod least_squares;
mod loss;
mod minimizer;
mod model;
mod motion;
mod multi_start;
mod null_space;
mod residuals;
mod settings;
mod solve;
mod status;

pub use bounds::Bound;
pub use curve::Curve;
pub use differences::jacobian_defect;
pub use error::FitError;
pub use fit::Fit;
pub use function_model::FunctionModel;
pub use least_squares::LeastSquares;
pub use loss::Loss;
pub use model::{Model, ModelFailure};
pub use motion::motion_model::MotionModel;
pub use motion::multiple_shooting::{MultipleShooting, ShootingFit};
pub use motion::observed::{Observable, Observed};
pub use multi_start::MultiStart;
pub use null_space::{NullDirection, NullSpace};
pub use status::{Criterion, FitStatus};
