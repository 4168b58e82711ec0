//! Dependent constraints: independent rows of a Jacobian, and multipliers of least norm.

use crate::numbers::max_abs_or_nan;
use crate::support::linear::{SingularMatrix, solve};
use nalgebra::{SMatrix, SVector};

/// A row counts as dependent on others if the part of it that is independent of them is smaller than this, relative to
/// the row: half of the digits, since the round-off of a dependent row is some units in the last place.
const DEPENDENT: f64 = 1e-8;

/// What happens where constraints are redundant: the rows of `c_q` are dependent, and c vanishes nevertheless on a
/// manifold, as for closed chains in space. The motion is determined; the multipliers are not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Redundancy {
    /// An error.
    #[default]
    Refuse,
    /// The motion is computed with independent constraints, and the multipliers are those of least norm among all that
    /// have the same force.
    LeastNorm,
}

impl Redundancy {
    /// The constraints that are imposed, for their number and their Jacobian at a point: all of them, or independent
    /// ones among them.
    pub fn imposed<const N: usize, const M: usize>(self, count: usize, jacobian: &SMatrix<f64, M, N>) -> [bool; M] {
        match self {
            Redundancy::Refuse => std::array::from_fn(|a| a < count),
            Redundancy::LeastNorm => independent_rows(jacobian),
        }
    }
}

/// Independent rows of a matrix: the largest rows first, each if it is independent of those before (Gram-Schmidt with
/// pivoting, relative to the norms of the rows).
pub fn independent_rows<const N: usize, const M: usize>(matrix: &SMatrix<f64, M, N>) -> [bool; M] {
    let norms: [f64; M] = std::array::from_fn(|a| matrix.row(a).norm());
    if !norms.iter().all(|norm| norm.is_finite()) {
        // Nothing is said about a matrix that is not finite: no row is left out, so that what is computed with it is not finite.
        return [true; M];
    }
    let largest = max_abs_or_nan(norms);
    let mut rest = *matrix;
    let mut independent = [false; M];
    for _ in 0..M.min(N) {
        let mut best: Option<(usize, f64)> = None;
        for a in 0..M {
            let size = rest.row(a).norm() / norms[a];
            let counts = !independent[a] && norms[a] > DEPENDENT * largest && size > DEPENDENT;
            if counts && best.is_none_or(|(_, found)| size > found) {
                best = Some((a, size));
            }
        }
        let Some((a, _)) = best else { break };
        independent[a] = true;
        let axis = rest.row(a).normalize();
        // Twice is enough for orthogonality to round-off.
        for _ in 0..2 {
            for mut row in rest.row_iter_mut() {
                let along = row.dot(&axis);
                row -= axis * along;
            }
        }
    }
    independent
}

/// The matrix with the rows and columns of dependent constraints replaced by those of the identity, so that it is
/// regular.
pub fn restricted<const M: usize>(mut matrix: SMatrix<f64, M, M>, independent: &[bool; M]) -> SMatrix<f64, M, M> {
    for (a, _) in independent.iter().enumerate().filter(|(_, kept)| !**kept) {
        matrix.row_mut(a).fill(0.0);
        matrix.column_mut(a).fill(0.0);
        matrix[(a, a)] = 1.0;
    }
    matrix
}

/// The multipliers of least norm with the same force `G^T lambda` as multipliers that vanish on dependent constraints.
///
/// With `G = T G_r` for the independent rows `G_r` they are `T (T^T T)^-1 lambda_r`: these have the same force, and
/// they are orthogonal to the kernel of `G^T`, which is that of `T^T`.
///
/// # Errors
/// [`SingularMatrix`] where the rows that are called independent are not.
pub fn least_norm<const N: usize, const M: usize>(
    jacobian: &SMatrix<f64, M, N>,
    independent: &[bool; M],
    multipliers: &SVector<f64, M>,
) -> Result<SVector<f64, M>, SingularMatrix> {
    if independent.iter().all(|kept| *kept) {
        return Ok(*multipliers);
    }
    let mut kept = *jacobian;
    for (a, _) in independent.iter().enumerate().filter(|(_, kept)| !**kept) {
        kept.row_mut(a).fill(0.0);
    }
    let gram = restricted(kept * kept.transpose(), independent);
    // The rows of T, each from G_r G_r^T t = G_r g.
    let mut t = SMatrix::<f64, M, M>::zeros();
    for a in 0..M {
        let mut row = kept * jacobian.row(a).transpose();
        solve(&mut gram.clone_owned(), &mut row)?;
        t.set_row(a, &row.transpose());
    }
    let mut weights = *multipliers;
    solve(&mut restricted(t.transpose() * t, independent), &mut weights)?;
    Ok(t * weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The third row is the sum of the first two: two rows are independent, and the multipliers of least norm have the
    /// same force and are orthogonal to `(1, 1, -1)`.
    #[test]
    fn multipliers_of_least_norm() {
        let g = SMatrix::<f64, 3, 4>::from_row_slice(&[1.0, 2.0, 0.0, 1.0, 0.0, 1.0, 3.0, 0.5, 1.0, 3.0, 3.0, 1.5]);
        let independent = independent_rows(&g);
        assert_eq!(independent.iter().filter(|kept| **kept).count(), 2);
        let mut lambda = SVector::from([0.7, -1.1, 0.4]);
        (0..3).filter(|a| !independent[*a]).for_each(|a| lambda[a] = 0.0);
        let least = least_norm(&g, &independent, &lambda).unwrap();
        // A few roundings of numbers up to 10.
        assert!((g.transpose() * (least - lambda)).amax() < 1e-14);
        assert!((least[0] + least[1] - least[2]).abs() < 1e-14);
        assert!(least.norm() < lambda.norm());
    }
}
