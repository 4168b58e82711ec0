//! Linear systems on the stack, over any scalar.

use crate::{GeometryError, Scalar};
use nalgebra::{Dim, Matrix, StorageMut, U1};
use thiserror::Error;

/// A matrix that has no inverse, or entries that are not finite.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("singular matrix (pivot {pivot:e})")]
pub struct SingularMatrix {
    /// The size of the pivot at which elimination stopped.
    pub pivot: f64,
}

impl SingularMatrix {
    /// The error of the geometry that says which matrix this is in the field's terms, and what to do.
    pub fn of(self, what: &'static str, remedy: &'static str) -> GeometryError {
        GeometryError::Singular { what, pivot: self.pivot, remedy }
    }
}

/// Solves `a x = b` by elimination with row pivoting, in place, over any [`Scalar`]; `a` and `b` are used up. Returns the
/// determinant of `a`, the product of the pivots.
///
/// nalgebra's factorisations ask for a field, which duals are not; and for the sizes of few-body mechanics this is faster
/// than any library call. Its cost is `N^3 / 3` products.
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

/// The same as a part of the code that calls it, for kernels over vector registers; see [`KernelDual`](crate::support::KernelDual).
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
