//! Maxima that propagate NaN.

use nalgebra::{Dim, Matrix, RawStorage};

/// The larger of two numbers; NaN where one of them is NaN. `f64::max` and nalgebra's `amax` discard a NaN, so that a
/// check that uses them cannot detect it.
///
/// ```
/// use contact_geom::numbers::max_or_nan;
/// assert_eq!(max_or_nan(1.0, 2.0), 2.0);
/// assert!(max_or_nan(f64::NAN, 2.0).is_nan() && max_or_nan(2.0, f64::NAN).is_nan());
/// ```
#[inline(always)]
pub fn max_or_nan(a: f64, b: f64) -> f64 {
    // If b is NaN, the comparison is false and b is returned.
    if a >= b || a.is_nan() { a } else { b }
}

/// The largest absolute value; 0 if there are no entries, NaN if an entry is NaN.
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

/// [`max_or_nan`] as a method, for chains of calls.
pub trait MaxOrNan {
    /// The larger of two numbers; NaN where one of them is NaN.
    #[must_use]
    fn max_or_nan(self, other: Self) -> Self;
}

impl MaxOrNan for f64 {
    #[inline(always)]
    fn max_or_nan(self, other: f64) -> f64 {
        max_or_nan(self, other)
    }
}

/// [`max_abs_or_nan`] of a matrix or a vector, where nalgebra's `amax` would discard a NaN.
///
/// ```
/// use contact_geom::{nalgebra::Vector2, numbers::{MaxOrNan, MaxAbsOrNan}};
/// assert_eq!(Vector2::new(1.0, -3.0).max_abs_or_nan().max_or_nan(2.0), 3.0);
/// assert!(Vector2::new(f64::NAN, -3.0).max_abs_or_nan().max_or_nan(2.0).is_nan());
/// ```
pub trait MaxAbsOrNan {
    /// The largest absolute entry; 0 if there are no entries, NaN if an entry is NaN.
    fn max_abs_or_nan(&self) -> f64;
}

impl<R: Dim, C: Dim, S: RawStorage<f64, R, C>> MaxAbsOrNan for Matrix<f64, R, C, S> {
    #[inline]
    fn max_abs_or_nan(&self) -> f64 {
        max_abs_or_nan(self.iter().copied())
    }
}
