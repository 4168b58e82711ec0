//! Variations of the Lagrangian in the derivative of a step.

use contact_geom::constraints::{Constraint, ConstraintDerivatives};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{ChartVector, Dual, Scalar, VelocityPoint};

/// A number with one derivative.
pub(super) type Along = Dual<f64, SVector<f64, 1>>;

/// What is added to the Lagrangian in a step over numbers T.
pub(super) trait Vary<const N: usize, T> {
    /// Whether something is added.
    const VARIES: bool;

    /// Adds the variation at a time and a point to the value and the gradient of L.
    fn add(&mut self, t: f64, x: &VelocityPoint<N, T>, value: &mut T, gradient: &mut ChartVector<N, T>);

    /// The values and the Jacobian of constraints at a position, with their variation.
    fn constraint<const M: usize>(
        &self,
        constraint: &impl Constraint<N, M>,
        q: &SVector<T, N>,
    ) -> (SVector<T, M>, SMatrix<T, M, N>);

    /// The values alone.
    fn constraint_values<const M: usize>(
        &self,
        constraint: &impl Constraint<N, M>,
        q: &SVector<T, N>,
    ) -> SVector<T, M> {
        self.constraint(constraint, q).0
    }
}

/// The Lagrangian itself.
pub(super) struct Unvaried;

impl<const N: usize, T: Scalar> Vary<N, T> for Unvaried {
    const VARIES: bool = false;

    fn add(&mut self, _: f64, _: &VelocityPoint<N, T>, _: &mut T, _: &mut ChartVector<N, T>) {}

    fn constraint<const M: usize>(
        &self,
        constraint: &impl Constraint<N, M>,
        q: &SVector<T, N>,
    ) -> (SVector<T, M>, SMatrix<T, M, N>) {
        constraint.with_jacobian(q)
    }

    fn constraint_values<const M: usize>(
        &self,
        constraint: &impl Constraint<N, M>,
        q: &SVector<T, N>,
    ) -> SVector<T, M> {
        constraint.value(q)
    }
}

/// The Lagrangian with a variation of first order, if there is one: its value and gradient are added to derivatives.
pub(super) struct Varied<'v, const N: usize> {
    pub of: Option<&'v mut Variation<'v, N>>,
    /// The parameter of which it is the variation, in which constraints vary too.
    pub parameter: Option<usize>,
}

/// The value and the gradient of a variation at a time and a point.
pub(super) type Variation<'v, const N: usize> = dyn FnMut(f64, &VelocityPoint<N>) -> (f64, ChartVector<N>) + 'v;

impl<const N: usize> Vary<N, Along> for Varied<'_, N> {
    const VARIES: bool = true;

    fn add(&mut self, t: f64, x: &VelocityPoint<N, Along>, value: &mut Along, gradient: &mut ChartVector<N, Along>) {
        let Some(variation) = &mut self.of else { return };
        let at = VelocityPoint { q: x.q.map(|q| q.re), v: x.v.map(|v| v.re), z: x.z.re };
        let (l, slope) = variation(t, &at);
        value.d[0] += l;
        for i in 0..N {
            gradient.x[i].d[0] += slope.x[i];
            gradient.y[i].d[0] += slope.y[i];
        }
        gradient.z.d[0] += slope.z;
    }

    fn constraint<const M: usize>(
        &self,
        constraint: &impl Constraint<N, M>,
        q: &SVector<Along, N>,
    ) -> (SVector<Along, M>, SMatrix<Along, M, N>) {
        let (mut c, mut g) = constraint.with_jacobian(q);
        let slopes = self.parameter.and_then(|k| constraint.in_parameter(k, &q.map(|q| q.re)));
        if let Some((of_value, of_jacobian)) = slopes {
            c.iter_mut().zip(&of_value).for_each(|(c, slope)| c.d[0] += slope);
            g.iter_mut().zip(&of_jacobian).for_each(|(g, slope)| g.d[0] += slope);
        }
        (c, g)
    }
}
