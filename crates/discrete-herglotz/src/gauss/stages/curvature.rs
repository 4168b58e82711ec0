//! The second derivatives of a separable Lagrangian in the positions.

use crate::system::mass_matrix::BLOCK;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Derivatives, Lagrangian, VelocityPoint, support::KernelDual};

/// `L_qq` at a time and a position, for separable L. Only the derivatives in q are computed, at a fraction of the cost
/// and of the memory of all second derivatives.
#[inline(never)]
pub(crate) fn curvature<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    q: &SVector<f64, N>,
) -> SMatrix<f64, N, N> {
    if const { N > BLOCK } {
        by_directions::<N, BLOCK>(lagrangian, t, q)
    } else {
        by_directions::<N, N>(lagrangian, t, q)
    }
}

/// `L_qq` by dual numbers with B directions at once.
#[inline(always)]
fn by_directions<const N: usize, const B: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    q: &SVector<f64, N>,
) -> SMatrix<f64, N, N> {
    let constant = KernelDual::<f64, SVector<f64, B>>::constant;
    let still = VelocityPoint { q: q.map(constant), v: SVector::from_element(constant(0.0)), z: constant(0.0) };
    let mut curvature = SMatrix::zeros();
    for first in (0..N).step_by(B.max(1)) {
        let mut x = still;
        let directions = first..(first + B).min(N);
        for j in directions.clone() {
            x.q[j].d[j - first] = 1.0;
        }
        let force = lagrangian.force(constant(t), &x);
        for j in directions {
            for i in 0..N {
                curvature[(i, j)] = force[i].d[j - first];
            }
        }
    }
    curvature
}
