//! What the iterations of both types share.

use crate::StepError;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::max_abs_or_nan;
use contact_geom::{PhasePoint, Scalar, support::linear};

/// The largest number of iterations of Newton's method.
pub(super) const MAX_ITERATIONS: u32 = 50;
/// The largest number of corrections with the last matrix: each corrects one order of the differentials.
pub(super) const MAX_CORRECTIONS: u32 = 12;
/// Newton's method ends at corrections of this relative size: since it converges quadratically, the rest is round-off,
/// which the corrections with the last matrix remove.
pub(super) const NEWTON_TOLERANCE: f64 = 1e-8;
/// The relative size of corrections that are round-off.
pub(super) const ROUND_OFF: f64 = 4.0 * f64::EPSILON;
/// Corrections of this relative size that no longer decrease are round-off too: that of the terms of a generating
/// function, which may be larger than their sum.
pub(super) const PLATEAU: f64 = 1e-11;

/// The inverse of a small matrix.
pub(super) fn inverse<const N: usize>(m: &SMatrix<f64, N, N>) -> Result<SMatrix<f64, N, N>, StepError> {
    let mut inverse = SMatrix::<f64, N, N>::zeros();
    for j in 0..N {
        let mut column = SVector::<f64, N>::from_fn(|i, _| if i == j { 1.0 } else { 0.0 });
        linear::solve(&mut m.clone_owned(), &mut column).map_err(|e| StepError::Singular { pivot: e.pivot })?;
        inverse.set_column(j, &column);
    }
    Ok(inverse)
}

/// `m x` for a matrix of numbers.
pub(super) fn times<T: Scalar, const N: usize>(m: &SMatrix<f64, N, N>, x: &SVector<T, N>) -> SVector<T, N> {
    SVector::from_fn(|i, _| (0..N).fold(T::zero(), |sum, j| sum + x[j] * m[(i, j)]))
}

/// The values of a state without its differentials.
pub(super) fn real<T: Scalar, const N: usize>(x: &PhasePoint<N, T>) -> PhasePoint<N> {
    PhasePoint { q: x.q.map(|e| e.re()), p: x.p.map(|e| e.re()), z: x.z.re() }
}

/// The largest magnitude in vectors, with their differentials; positive, so that one can divide by it.
pub(super) fn scale<T: Scalar, const N: usize, const K: usize>(vectors: [&SVector<T, N>; K]) -> f64 {
    let entries = vectors.into_iter().flat_map(|v| v.iter().map(|e| e.extent()));
    max_abs_or_nan(entries.chain([f64::MIN_POSITIVE]))
}
