//! Errors of the geometric formulas.

use thiserror::Error;

/// Invalid input to a geometric formula, reported instead of a result.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum GeometryError {
    /// A slice has the wrong number of entries.
    #[error(
        "{what} has {found} entries, but the configuration space has dimension {expected}; pass {expected} entries"
    )]
    WrongSize {
        /// The coordinate that the slice specifies.
        what: &'static str,
        /// The dimension N.
        expected: usize,
        /// The number of entries that were passed.
        found: usize,
    },
    /// A number is infinite or NaN.
    #[error("{what}[{index}] = {value}; it must be a finite number")]
    NonFinite {
        /// What the number is.
        what: &'static str,
        /// Its index in its block.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A matrix that the formula inverts is singular.
    #[error("{what} is singular (pivot {pivot:e}): {remedy}")]
    Singular {
        /// The usual name of the matrix.
        what: &'static str,
        /// The absolute value of the pivot that vanishes or is not finite, or the smallest singular value relative to
        /// the largest.
        pivot: f64,
        /// A suggestion for the caller.
        remedy: &'static str,
    },
    /// A function is not defined at a point, or could not be evaluated there.
    #[error("{what} is not defined at this point; choose a point inside its domain")]
    Undefined {
        /// The usual name of the function.
        what: &'static str,
    },
}
