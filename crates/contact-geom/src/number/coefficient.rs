//! The types of the coefficients of a formula.

use crate::Scalar;
use std::ops::{Add, Mul, Neg, Sub};

/// A type of coefficients of a formula: `f64`, or a [`Scalar`] where the formula is differentiated with respect to them.
/// It is implemented for every type with these operations.
pub trait Coefficient:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
    + Add<f64, Output = Self>
{
}

impl<C> Coefficient for C where
    C: Copy
        + Add<Output = C>
        + Sub<Output = C>
        + Mul<Output = C>
        + Neg<Output = C>
        + Mul<f64, Output = C>
        + Add<f64, Output = C>
{
}

/// A [`Scalar`] whose products and sums with coefficients of type C are defined. A formula over `T: ScalarOver<C>` is
/// written once: with C = `f64` it has the operations of a formula whose coefficients are plain numbers, with C = T it
/// can be differentiated with respect to them. It is implemented for every type with these operations.
///
/// ```
/// use contact_geom::numbers::{Coefficient, ScalarOver};
/// fn potential<C: Coefficient, T: ScalarOver<C>>(stiffness: C, q: T) -> T {
///     q * q * (stiffness * 0.5)
/// }
/// assert_eq!(potential(3.0, 2.0), 6.0);
/// ```
pub trait ScalarOver<C>: Scalar + Mul<C, Output = Self> + Add<C, Output = Self> {}

impl<C, T: Scalar + Mul<C, Output = T> + Add<C, Output = T>> ScalarOver<C> for T {}
