//! The applied force with its derivatives, for the Jacobians of the stage equations.

use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{ChartVector, Dual, Lagrangian, VelocityPoint, support::seed};

/// The applied force f at a point, with its derivatives.
pub(crate) struct AppliedForce<const N: usize> {
    pub value: SVector<f64, N>,
    pub q: SMatrix<f64, N, N>,
    pub v: SMatrix<f64, N, N>,
    pub z: SVector<f64, N>,
}

impl<const N: usize> AppliedForce<N> {
    /// The force of a Lagrangian at a point; `None`, at compile time, if it has none.
    #[inline(always)]
    pub fn of<L: Lagrangian<N>>(lagrangian: &L, t: f64, x: &VelocityPoint<N>) -> Option<Self> {
        if const { L::HINTS.forced } { Some(Self::at(lagrangian, t, x)) } else { None }
    }

    #[inline(never)]
    fn at<L: Lagrangian<N>>(lagrangian: &L, t: f64, x: &VelocityPoint<N>) -> Self {
        let x: VelocityPoint<N, Dual<f64, ChartVector<N>>> = seed(&ChartVector::from(*x)).into();
        let force = lagrangian.applied_force(Dual::constant(t), &x);
        AppliedForce {
            value: force.map(|f| f.re),
            q: SMatrix::from_fn(|i, j| force[i].d.x[j]),
            v: SMatrix::from_fn(|i, j| force[i].d.y[j]),
            z: force.map(|f| f.d.z),
        }
    }
}
