//! The index of a critical path: the inertia of the second variation of the action.

use super::block_elimination::{Equations, Nodes, Undefined};
use super::end::Conditions;
use crate::DiscreteLagrangian;
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};

/// The numbers of negative and of vanishing directions of the second variation; `None` for a periodic path, for one with
/// forces, and where a `sigma_d` is not positive.
///
/// At a critical path the Hessian of `A_d` in the free positions is block tridiagonal, because the action at a point
/// depends on the positions before the last one only to second order. Divided by the product of the sigma_d after point
/// k, its blocks are `K_k = D11 + p D1z^T + D1z p^T + p p^T Dzz + sigma D22'` and `F_k = D12 + p D2z^T` (p and D22' of
/// the step before point k, the others of the step after it); the block below is `sigma_{k+1} F_k^T`. With
/// `S_{k+1} = K_{k+1} - sigma_{k+1} F_k^T S_k^-1 F_k`, the inertia is the sum of those of the symmetric matrices `S_k`
/// (Haynsworth), whose determinants change their sign at conjugate points.
pub(super) fn inertia<D: DiscreteLagrangian<N>, const N: usize>(
    of: &Equations<'_, D, N>,
    x: &Nodes<N>,
) -> Result<Option<(usize, usize)>, Undefined> {
    let Conditions::Ends(start, end) = of.conditions else {
        return Ok(None);
    };
    if of.ld.has_forces() {
        return Ok(None);
    }
    let steps = of.steps;
    // The momentum and the second derivative D22 of the previous step, and the matrix `F_k^T S_k^-1 F_k`.
    let (mut p, mut d22, mut carried) =
        (start.momentum(), SMatrix::<f64, N, N>::zeros(), SMatrix::<f64, N, N>::zeros());
    let (mut negative, mut vanishing) = (0, 0);
    for k in 0..=steps {
        let jet = if k < steps { Some(of.jet(k, &x.q[k], &x.q[k + 1], x.z[k])?) } else { None };
        if jet.is_some_and(|jet| jet.first.sigma() <= 0.0) {
            return Ok(None);
        }
        let given = match k {
            0 => start.position().is_some(),
            _ => k == steps && end.position().is_some(),
        };
        let sigma = jet.map_or(1.0, |jet| jet.first.sigma());
        if !given {
            let p = p.unwrap_or_else(SVector::zeros);
            let (mut block, mut next) = (d22 * sigma, SMatrix::zeros());
            if let Some(jet) = &jet {
                block += jet.d11 + p * jet.d1z.transpose() + jet.d1z * p.transpose() + p * p.transpose() * jet.dzz;
                next = jet.d12 + p * jet.d2z.transpose();
            }
            let scale = block.iter().fold(0.0, |m: f64, e| m.max(e.abs()));
            let schur = block - carried * sigma;
            let (less, none, inverse) = inverted(&schur, scale);
            negative += less;
            // A vanishing eigenvalue before the last block is not a vanishing direction of the Hessian: the next block
            // then has a large one of the opposite sign.
            let last = k == steps || (k + 1 == steps && end.position().is_some());
            vanishing += if last { none } else { 0 };
            carried = next.transpose() * inverse * next;
        }
        if let Some(jet) = jet {
            (p, d22) = (Some(jet.first.d2), jet.d22);
        }
    }
    Ok(Some((negative, vanishing)))
}

/// The numbers of negative and of vanishing eigenvalues of a symmetric matrix, and its inverse. A vanishing eigenvalue
/// is replaced by the round-off of the terms whose difference the matrix is.
fn inverted<const N: usize>(matrix: &SMatrix<f64, N, N>, scale: f64) -> (usize, usize, SMatrix<f64, N, N>) {
    let eigen = DMatrix::from_fn(N, N, |i, j| 0.5 * (matrix[(i, j)] + matrix[(j, i)])).symmetric_eigen();
    let round_off = 4.0 * f64::EPSILON * scale;
    let (mut negative, mut vanishing) = (0, 0);
    let mut inverse = SMatrix::zeros();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        let vanishes = value.abs() <= round_off;
        vanishing += usize::from(vanishes);
        negative += usize::from(!vanishes && *value < 0.0);
        let value = if vanishes { round_off.max(f64::MIN_POSITIVE) } else { *value };
        for (i, j) in (0..N).flat_map(|i| (0..N).map(move |j| (i, j))) {
            inverse[(i, j)] += vector[i] * vector[j] / value;
        }
    }
    (negative, vanishing, inverse)
}
