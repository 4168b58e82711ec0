//! A small real matrix in factors.

use crate::StepError;
use contact_geom::Scalar;
use contact_geom::nalgebra::{SMatrix, SVector};

/// The factors `P A = L U` of a matrix, with which systems are solved whose right-hand sides are any numbers.
pub(super) struct Factored<const M: usize> {
    /// U, and below its diagonal L without its ones.
    factors: SMatrix<f64, M, M>,
    /// The row of A that each row of the factors is of.
    rows: [usize; M],
}

impl<const M: usize> Factored<M> {
    /// Factors a matrix by elimination with partial pivoting.
    ///
    /// # Errors
    /// [`StepError::Singular`] where a pivot vanishes or is not finite.
    pub fn new(mut a: SMatrix<f64, M, M>) -> Result<Self, StepError> {
        let mut rows = std::array::from_fn(|i| i);
        for k in 0..M {
            let row = (k + 1..M).fold(k, |row, i| if a[(i, k)].abs() > a[(row, k)].abs() { i } else { row });
            let pivot = a[(row, k)].abs();
            if !(pivot > 0.0 && pivot.is_finite()) {
                return Err(StepError::Singular { pivot });
            }
            a.swap_rows(k, row);
            rows.swap(k, row);
            let inverse = a[(k, k)].recip();
            for i in k + 1..M {
                let factor = a[(i, k)] * inverse;
                a[(i, k)] = factor;
                // Entries that vanish, as those of constraints that are not there, change nothing.
                if factor != 0.0 {
                    for j in k + 1..M {
                        a[(i, j)] -= factor * a[(k, j)];
                    }
                }
            }
        }
        Ok(Factored { factors: a, rows })
    }

    /// The solution of `A x = b`.
    pub fn solve<T: Scalar>(&self, b: &SVector<T, M>) -> SVector<T, M> {
        let mut x = SVector::<T, M>::from_fn(|i, _| b[self.rows[i]]);
        for i in 1..M {
            for j in 0..i {
                let above = x[j];
                x[i] -= above * self.factors[(i, j)];
            }
        }
        for i in (0..M).rev() {
            for j in i + 1..M {
                let below = x[j];
                x[i] -= below * self.factors[(i, j)];
            }
            x[i] /= T::from(self.factors[(i, i)]);
        }
        x
    }
}
