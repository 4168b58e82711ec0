//! The largest of numbers among which there may be one that is not a number.

use nalgebra::{Dim, Matrix, RawStorage};

/// The larger of two numbers; not a number where one is not. `f64::max` and nalgebra's `amax` lose a NaN, and a check that
/// uses them cannot fail on it.
///
/// ```
/// use contact_geom::numbers::max_or_nan;
/// assert_eq!(max_or_nan(1.0, 2.0), 2.0);
/// assert!(max_or_nan(f64::NAN, 2.0).is_nan() && max_or_nan(2.0, f64::NAN).is_nan());
/// ```
#[inline(always)]
pub fn max_or_nan(a: f64, b: f64) -> f64 {
    // Where b is not a number neither comparison holds.
    if a >= b || a.is_nan() { a } else { b }
}

/// The largest absolute value, 0 of nothing; not a number where an entry is not.
///
/// ```
/// use contact_geom::numbers::max_abs_or_nan;
/// assert_eq!(max_abs_or_nan([1.0, -3.0, 2.0]), 3.0);
/// assert!(max_abs_or_nan([1.0, f64::NAN, 2.0]).is_nan());
/// ```
#[inline]
pub fn max_abs_or_nan(entries: impl IntoIterator<Item = f64>) -> f64 {
    entries.into_iter().fold(0.0, |m, e| max_or_nan(m, e.abs()))
}

/// [`max_or_nan`] as a method: for chains, where `max` would lose a NaN.
pub trait MaxOrNan {
    /// The larger of two numbers; not a number where one is not.
    #[must_use]
    fn max_or_nan(self, other: Self) -> Self;
}

impl MaxOrNan for f64 {
    #[inline(always)]
    fn max_or_nan(self, other: f64) -> f64 {
        max_or_nan(self, other)
    }
}

/// [`max_abs_or_nan`] of a matrix or a vector, for which nalgebra's `amax` would lose a NaN.
///
/// ```
/// use contact_geom::{nalgebra::Vector2, numbers::{MaxOrNan, MaxAbsOrNan}};
/// assert_eq!(Vector2::new(1.0, -3.0).max_abs_or_nan().max_or_nan(2.0), 3.0);
/// assert!(Vector2::new(f64::NAN, -3.0).max_abs_or_nan().max_or_nan(2.0).is_nan());
/// ```
pub trait MaxAbsOrNan {
    /// The largest absolute entry, 0 of nothing; not a number where an entry is not.
    fn max_abs_or_nan(&self) -> f64;
}

impl<R: Dim, C: Dim, S: RawStorage<f64, R, C>> MaxAbsOrNan for Matrix<f64, R, C, S> {
    #[inline]
    fn max_abs_or_nan(&self) -> f64 {
        max_abs_or_nan(self.iter().copied())
    }
}
