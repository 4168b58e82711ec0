//! What can be wrong with the input of the geometry.

use thiserror::Error;

/// Bad input to a formula of the geometry, found before an answer is given.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum GeometryError {
    /// A slice has the wrong number of entries.
    #[error("{what} has {found} entries where the configuration space has dimension {expected}; pass {expected}")]
    WrongSize {
        /// The coordinate that the slice was meant for.
        what: &'static str,
        /// The dimension N.
        expected: usize,
        /// The entries that were passed.
        found: usize,
    },
    /// A number is infinite or not a number.
    #[error("{what}[{index}] = {value} where a finite number is needed")]
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
        /// The matrix, in the field's terms.
        what: &'static str,
        /// The vanishing or non-finite pivot, relative to the largest entry.
        pivot: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A function is not defined at a point, or could not be evaluated there.
    #[error("{what} is not defined at this point; choose one inside its domain")]
    Undefined {
        /// The function, in the field's terms.
        what: &'static str,
    },
}
