//! The largest of numbers among which there may be one that is not a number.

use nalgebra::{Dim, Matrix, RawStorage};

/// The larger of two numbers; not a number where one is not. `f64::max` and nalgebra's `amax` lose a NaN, and a check that
/// uses them cannot fail on it.
///
/// ```
/// use contact_geom::larger;
/// assert_eq!(larger(1.0, 2.0), 2.0);
/// assert!(larger(f64::NAN, 2.0).is_nan() && larger(2.0, f64::NAN).is_nan());
/// ```
#[inline(always)]
pub fn larger(a: f64, b: f64) -> f64 {
    // Where b is not a number neither comparison holds.
    if a >= b || a.is_nan() { a } else { b }
}

/// The largest absolute value, 0 of nothing; not a number where an entry is not.
///
/// ```
/// use contact_geom::largest;
/// assert_eq!(largest([1.0, -3.0, 2.0]), 3.0);
/// assert!(largest([1.0, f64::NAN, 2.0]).is_nan());
/// ```
#[inline]
pub fn largest(entries: impl IntoIterator<Item = f64>) -> f64 {
    entries.into_iter().fold(0.0, |m, e| larger(m, e.abs()))
}

/// [`larger`] as a method: for chains, where `max` would lose a NaN.
pub trait Larger {
    /// The larger of two numbers; not a number where one is not.
    #[must_use]
    fn larger(self, other: Self) -> Self;
}

impl Larger for f64 {
    #[inline(always)]
    fn larger(self, other: f64) -> f64 {
        larger(self, other)
    }
}

/// [`largest`] of a matrix or a vector, for which nalgebra's `amax` would lose a NaN.
///
/// ```
/// use contact_geom::{nalgebra::Vector2, Larger, Largest};
/// assert_eq!(Vector2::new(1.0, -3.0).largest().larger(2.0), 3.0);
/// assert!(Vector2::new(f64::NAN, -3.0).largest().larger(2.0).is_nan());
/// ```
pub trait Largest {
    /// The largest absolute entry, 0 of nothing; not a number where an entry is not.
    fn largest(&self) -> f64;
}

impl<R: Dim, C: Dim, S: RawStorage<f64, R, C>> Largest for Matrix<f64, R, C, S> {
    #[inline]
    fn largest(&self) -> f64 {
        largest(self.iter().copied())
    }
}
