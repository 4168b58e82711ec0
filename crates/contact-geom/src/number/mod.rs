//! Numbers: scalars, dual numbers, small linear systems, and maxima that keep a NaN.

mod coefficient;
mod dual;
mod legendre_polynomials;
pub mod linear;
mod max_or_nan;
mod module;
#[cfg(feature = "num-dual")]
mod num_dual;
mod operators;
mod regularity;
pub(crate) mod rounded;
mod scalar;
mod vector;

pub use coefficient::{Coefficient, ScalarOver};
pub use dual::{Dual, KernelDual};
pub use legendre_polynomials::legendre_polynomials;
pub use max_or_nan::{MaxAbsOrNan, MaxOrNan, max_abs_or_nan, max_or_nan};
pub use module::{AugmentedVector, TangentVector};
pub use regularity::Regularity;
pub use scalar::Scalar;
pub use vector::{dot, vector_of};
