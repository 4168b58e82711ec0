//! The mass matrix `W = L_vv` and its inverse.

use crate::TypedSystem;
use contact_geom::VelocityPoint;
use contact_geom::nalgebra::{DMatrix, SMatrix};
use contact_geom::support::linear::{self, SingularMatrix};

/// The largest number of directional derivatives that are computed at once. More are computed in blocks, so that the
/// dual numbers stay small enough for the stack and for registers.
pub(crate) const BLOCK: usize = 8;

/// The mass matrix W. For many coordinates it is computed alone; for few it is taken from the full Hessian, which is
/// compiled in any case.
pub(crate) fn mass_matrix<const N: usize>(
    system: &dyn TypedSystem<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> SMatrix<f64, N, N> {
    if const { N > BLOCK } { system.mass_matrix(t, x) } else { system.hessian(t, x).vv }
}

/// The largest number of coordinates for which a matrix is inverted column by column, without an allocation.
pub(crate) const MAX_BY_COLUMNS: usize = 16;

/// The inverse of a matrix whose size is known at run time.
///
/// # Errors
/// [`SingularMatrix`].
pub(crate) fn inverse(m: &DMatrix<f64>) -> Result<DMatrix<f64>, SingularMatrix> {
    if m.nrows() > MAX_BY_COLUMNS && !is_diagonal(m) {
        return m.clone().try_inverse().ok_or(SingularMatrix { pivot: 0.0 });
    }
    inverse_by_columns(m)
}

/// Whether all entries beside the diagonal are 0.
fn is_diagonal(m: &DMatrix<f64>) -> bool {
    (0..m.ncols()).all(|j| (0..m.nrows()).all(|i| i == j || m[(i, j)] == 0.0))
}

/// The inverse of a matrix whose size is known at run time, computed column by column, or by its diagonal.
///
/// # Errors
/// [`SingularMatrix`].
pub(crate) fn inverse_by_columns(m: &DMatrix<f64>) -> Result<DMatrix<f64>, SingularMatrix> {
    let n = m.nrows();
    let mut inverse = DMatrix::identity(n, n);
    if is_diagonal(m) {
        for i in 0..n {
            let pivot = m[(i, i)].abs();
            // Written so that a NaN is singular.
            if !(pivot > 0.0 && pivot.is_finite()) {
                return Err(SingularMatrix { pivot });
            }
            inverse[(i, i)] /= m[(i, i)];
        }
        return Ok(inverse);
    }
    let mut copy = DMatrix::zeros(n, n);
    for mut column in inverse.column_iter_mut() {
        copy.copy_from(m);
        linear::solve(&mut copy, &mut column)?;
    }
    Ok(inverse)
}

/// Whether a matrix is the identity; compared entry by entry, to save stack space.
pub(crate) fn is_identity<const N: usize>(m: &SMatrix<f64, N, N>) -> bool {
    (0..N).all(|j| (0..N).all(|i| m[(i, j)] == f64::from(u8::from(i == j))))
}

/// The mass matrix W on the heap, to be kept.
#[inline(never)]
pub(crate) fn kept_mass_matrix<const N: usize>(
    system: &dyn TypedSystem<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Box<SMatrix<f64, N, N>> {
    Box::new(mass_matrix(system, t, x))
}

/// The inverse of a matrix, computed column by column, on the heap.
#[inline(never)]
pub(crate) fn inverted<const N: usize>(m: &SMatrix<f64, N, N>) -> Result<Box<SMatrix<f64, N, N>>, SingularMatrix> {
    let mut inverse = SMatrix::<f64, N, N>::identity();
    for mut column in inverse.column_iter_mut() {
        linear::solve(&mut m.clone_owned(), &mut column)?;
    }
    Ok(Box::new(inverse))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The inverse of a diagonal matrix, and of one with another entry, of few and of many coordinates.
    #[test]
    fn a_matrix_times_its_inverse_is_the_identity() {
        for n in [1, 3, MAX_BY_COLUMNS, MAX_BY_COLUMNS + 4] {
            let diagonal = DMatrix::from_fn(n, n, |i, j| if i == j { 2.0 + i as f64 } else { 0.0 });
            let mut other = diagonal.clone();
            other[(n - 1, 0)] += 0.25;
            for m in [&diagonal, &other] {
                let off = (inverse(m).unwrap() * m - DMatrix::identity(n, n)).amax();
                assert!(off <= 2.0 * f64::EPSILON, "{n}: {off:e}");
            }
            for entry in [0.0, f64::NAN, f64::INFINITY] {
                let mut singular = diagonal.clone();
                singular[(n / 2, n / 2)] = entry;
                let pivot = inverse(&singular).unwrap_err().pivot;
                assert!(pivot == entry || pivot.is_nan() && entry.is_nan(), "{n}: {pivot}, not {entry}");
            }
        }
    }
}
