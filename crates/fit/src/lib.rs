//! Fits of motions to data, and nonlinear least squares.
//!
//! A [`MotionModel`] is what was observed of a motion as a function of parameters of its Lagrangian and of its start; its
//! Jacobian is that of the computed motion, exactly. [`LeastSquares`] fits it, or any other [`Model`], to data.
//!
//! ```
//! use contact_examples::systems::Pendulum;
//! use contact_geom::VelocityPoint;
//! use discrete_herglotz::sensitivity::Variable;
//! use herglotz_fit::{LeastSquares, MotionModel, Observed};
//! let times = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0];
//! let angles = [0.886, 0.579, 0.152, -0.294, -0.657, -0.850];
//! let unknowns = [Variable::Parameter("gamma".into()), Variable::Position(0)];
//! let guess = (Pendulum { gamma: -0.2 }, VelocityPoint::new([1.0], [0.0], 0.0));
//! let model = MotionModel::new(&guess.0, 0.0, guess.1, &unknowns, 0.5)?.observe(Observed::Position(0), &times)?;
//! println!("{}", LeastSquares::new(&model, &angles)?.solve(&model.start())?);
//! # Ok::<(), herglotz_fit::FitError>(())
//! ```
//!
//! # Least squares
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
//!
//! # Long and chaotic motions
//!
//! The end of such a motion depends on its start so strongly that a fit ends in one of many local minima.
//! [`LeastSquares::multiple_shooting`] cuts the motion at nodes whose states are further unknowns, and [several
//! starts](LeastSquares::solve_from) find the best of several minima.

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
pub use motion::piecewise::{Observation, Piece, PieceValues, PiecewiseModel};
pub use multi_start::MultiStart;
pub use nalgebra::DMatrix;
pub use null_space::{NullDirection, NullSpace};
pub use status::{Criterion, FitStatus};
