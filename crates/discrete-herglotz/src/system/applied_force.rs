//! The applied force with its derivatives.

use super::ForceDerivatives;
use crate::{Point, Vector};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::{ChartVector, Dual, Lagrangian, ScalarSystem, SlicesVisitor, VelocityPoint, support::seed};
use std::sync::Arc;

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

impl ForceDerivatives {
    /// The applied force of a system over slices at a point; `None` if it has none.
    pub fn of_slices(slices: &impl ScalarSystem, t: f64, x: &Point) -> Option<Self> {
        type Along = Dual<f64, SVector<f64, 1>>;
        if !slices.has_force() {
            return None;
        }
        let n = x.q.len();
        let (square, line) = (|| DMatrix::zeros(n, n), || Vector::zeros(n));
        let mut to = ForceDerivatives { value: line(), q: square(), v: square(), z: line() };
        let still = |x: &[f64]| -> Vec<Along> { x.iter().map(|x| Along::from(*x)).collect() };
        let (mut q, mut v, mut z) = (still(&x.q), still(&x.v), Along::from(x.z));
        let mut force = vec![Along::from(0.0); n];
        for j in 0..=2 * n {
            let direction = |k: usize| SVector::<f64, 1>::from_element(f64::from(u8::from(k == j)));
            q.iter_mut().enumerate().for_each(|(k, q)| q.d = direction(k));
            v.iter_mut().enumerate().for_each(|(k, v)| v.d = direction(n + k));
            z.d = direction(2 * n);
            slices.applied_force::<Along, 0>(Along::from(t), &q, &v, z, &mut force);
            for (i, force) in force.iter().enumerate() {
                match j {
                    j if j < n => to.q[(i, j)] = force.d[0],
                    j if j < 2 * n => to.v[(i, j - n)] = force.d[0],
                    _ => (to.z[i], to.value[i]) = (force.d[0], force.re),
                }
            }
        }
        Some(to)
    }
}

/// Computes [`ForceDerivatives::of_slices`].
pub(super) struct ForceAt<'x> {
    pub t: f64,
    pub x: &'x Point,
}

impl SlicesVisitor for ForceAt<'_> {
    type Output = Option<ForceDerivatives>;

    fn visit<F: ScalarSystem + 'static>(self, slices: Arc<F>) -> Self::Output {
        ForceDerivatives::of_slices(&*slices, self.t, self.x)
    }
}
