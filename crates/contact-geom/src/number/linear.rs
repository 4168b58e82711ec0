//! Small linear systems over any scalar, solved in place.

use crate::{GeometryError, Scalar};
use nalgebra::{Dim, Matrix, StorageMut, U1};
use thiserror::Error;

/// The error for a matrix that has no inverse, or entries that are not finite.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("singular matrix (pivot {pivot:e})")]
pub struct SingularMatrix {
    /// The size of the pivot at which elimination stopped.
    pub pivot: f64,
}

impl SingularMatrix {
    /// The corresponding error of the geometry, with the usual name of the matrix and a suggestion for the caller.
    pub fn of(self, what: &'static str, remedy: &'static str) -> GeometryError {
        GeometryError::Singular { what, pivot: self.pivot, remedy }
    }
}

/// Solves `a x = b` by Gaussian elimination with partial pivoting, over any [`Scalar`]. The solution overwrites `b`,
/// and `a` is overwritten as well. Returns the determinant of `a`, the product of the pivots.
///
/// nalgebra's factorisations require a field, which dual numbers are not; for the sizes of few-body mechanics this
/// function is also faster than any library call. Its cost is `N^3 / 3` products.
///
/// # Errors
/// [`SingularMatrix`] where a pivot vanishes or is not finite.
#[inline]
pub fn solve<T: Scalar, D: Dim>(
    a: &mut Matrix<T, D, D, impl StorageMut<T, D, D>>,
    b: &mut Matrix<T, D, U1, impl StorageMut<T, D>>,
) -> Result<T, SingularMatrix> {
    solve_in_kernel(a, b)
}

/// The same, inlined into the calling code, for SIMD kernels; see [`KernelDual`](crate::support::KernelDual).
///
/// # Errors
/// [`SingularMatrix`] where a pivot vanishes or is not finite.
#[inline(always)]
pub fn solve_in_kernel<T: Scalar, D: Dim>(
    a: &mut Matrix<T, D, D, impl StorageMut<T, D, D>>,
    b: &mut Matrix<T, D, U1, impl StorageMut<T, D>>,
) -> Result<T, SingularMatrix> {
    let n = a.nrows();
    let mut determinant = T::one();
    for k in 0..n {
        let mut row = k;
        for i in k + 1..n {
            if a[(i, k)].pivot_size() > a[(row, k)].pivot_size() {
                row = i;
            }
        }
        let size = a[(row, k)].pivot_size();
        if !(size > 0.0 && size.is_finite()) {
            return Err(SingularMatrix { pivot: size });
        }
        if row != k {
            a.swap_rows(k, row);
            b.swap_rows(k, row);
            determinant = -determinant;
        }
        determinant *= a[(k, k)];
        let inverse = a[(k, k)].recip();
        for i in k + 1..n {
            let factor = a[(i, k)] * inverse;
            for j in k + 1..n {
                let above = a[(k, j)];
                a[(i, j)] -= factor * above;
            }
            let above = b[k];
            b[i] -= factor * above;
        }
    }
    for k in (0..n).rev() {
        let mut sum = b[k];
        for j in k + 1..n {
            sum -= a[(k, j)] * b[j];
        }
        b[k] = sum / a[(k, k)];
    }
    Ok(determinant)
}
