//! Numbers: scalars, dual numbers, small linear systems, and maxima that keep a NaN.

mod dual;
mod largest;
mod legendre_polynomials;
pub mod linear;
mod module;
#[cfg(feature = "num-dual")]
mod num_dual;
mod operators;
pub(crate) mod rounded;
mod scalar;

pub use dual::{Dual, KernelDual};
pub use largest::{Larger, Largest, larger, largest};
pub use legendre_polynomials::legendre_polynomials;
pub use module::{Border, Module};
pub use scalar::Scalar;
