//! The regularity of a matrix.

use nalgebra::DMatrix;

/// The regularity of a matrix of the theory, W for a Lagrangian or the derivative of F-L_d for a discrete Lagrangian:
/// its extreme singular values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Regularity {
    /// The smallest singular value; 0 where the Lagrangian is singular.
    pub smallest: f64,
    /// The largest singular value.
    pub largest: f64,
}

impl Regularity {
    /// The extreme singular values of a matrix. A matrix that is not finite counts as singular.
    pub fn of(matrix: DMatrix<f64>) -> Self {
        if !matrix.iter().all(|e| e.is_finite()) {
            return Regularity { smallest: 0.0, largest: f64::INFINITY };
        }
        if matrix.is_empty() {
            // The only matrix of dimension 0 is the identity.
            return Regularity { smallest: 1.0, largest: 1.0 };
        }
        let values = matrix.singular_values();
        Regularity { smallest: values.min(), largest: values.max() }
    }

    /// The condition number; infinite for a singular matrix. A linear solve has about `16 - log10(condition)` correct
    /// digits.
    pub fn condition(&self) -> f64 {
        if self.smallest > 0.0 { self.largest / self.smallest } else { f64::INFINITY }
    }
}
