//! Inverses of matrices by sizes that the compiler does not know: compiled once, with this crate, and not with each program.

use contact_geom::nalgebra::{Complex, DMatrix, DMatrixViewMut};

/// The inverse of a matrix; `None` where it is singular.
pub(crate) fn inverse(m: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    m.clone().try_inverse()
}

/// Inverts a complex matrix of `n` rows in place, without allocation where there are at most four; `false` where it is singular.
pub(crate) fn invert_complex(m: &mut [Complex<f64>], n: usize) -> bool {
    DMatrixViewMut::from_slice(m, n, n).try_inverse_mut()
}
