//! Inverses of matrices of dynamic size, compiled once with this crate and not with each program.

use contact_geom::nalgebra::{Complex, DMatrix, DMatrixViewMut};

/// The inverse of a matrix; `None` if it is singular.
pub(crate) fn inverse(m: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    m.clone().try_inverse()
}

/// Inverts a complex matrix of `n` rows in place, without allocation for at most four rows; `false` if it is singular.
pub(crate) fn invert_complex(m: &mut [Complex<f64>], n: usize) -> bool {
    DMatrixViewMut::from_slice(m, n, n).try_inverse_mut()
}
