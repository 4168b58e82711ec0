//! The momentum equations of a step of a path, with its discrete forces, and their derivatives.

use crate::theory::{DiscreteForces, ForceSlopes, discrete_forces};
use crate::{DiscreteLagrangian, StepError};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{DiscretePoint, SecondDiscreteJet};
use std::marker::PhantomData;

/// The discrete forces of a step, if there are any, which enter its two momenta: `sigma_d p0 = -(D1 L_d + F-)` and
/// `p1 = D2 L_d + F+`. The recursion of the action does not contain them.
///
/// Without forces the derivatives of both momenta are those of one symmetric matrix: that of `D2 L_d` in q0 is the
/// transpose of that of `D1 L_d` in q1, and both derivatives in z0 are those of `sigma_d`. With forces they are not.
pub(super) struct StepForces<D, const N: usize> {
    forces: Option<DiscreteForces<N>>,
    of: PhantomData<D>,
}

// Derived, these would need a discrete Lagrangian that can be copied.
impl<D, const N: usize> Clone for StepForces<D, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<D, const N: usize> Copy for StepForces<D, N> {}

impl<D: DiscreteLagrangian<N>, const N: usize> StepForces<D, N> {
    /// The forces of a step.
    #[inline(always)]
    pub fn at(ld: &D, t: f64, x: &DiscretePoint<N>) -> Result<Self, StepError> {
        let forces = if const { D::FORCED } && ld.has_forces() { Some(discrete_forces(ld, t, x)?) } else { None };
        Ok(StepForces { forces, of: PhantomData })
    }

    /// The forces; `None` at compile time for a discrete Lagrangian that has none.
    #[inline(always)]
    fn some(&self) -> Option<&DiscreteForces<N>> {
        if const { D::FORCED } { self.forces.as_ref() } else { None }
    }

    /// Whether all entries are finite.
    #[inline(always)]
    pub fn is_finite(&self) -> bool {
        // The product with zero is zero unless an entry is infinite or NaN, or a sum overflows.
        let finite = |f: &SVector<f64, N>, (of_q0, of_q1, of_z): &ForceSlopes<N>| {
            (f.sum() + of_q0.sum() + of_q1.sum() + of_z.sum()) * 0.0 == 0.0
        };
        self.some().is_none_or(|f| finite(&f.minus, &f.minus_slopes) && finite(&f.plus, &f.plus_slopes))
    }

    /// Whether a force depends on the action, or is NaN.
    #[inline(always)]
    pub fn depend_on_action(&self) -> bool {
        // The comparison is written so that it holds for a NaN.
        self.some().is_some_and(|f| f.minus_slopes.2.abs().sum() + f.plus_slopes.2.abs().sum() != 0.0)
    }

    /// `D1 L_d + F-`.
    #[inline(always)]
    pub fn pull(&self, jet: &SecondDiscreteJet<N>) -> SVector<f64, N> {
        self.some().map_or(jet.first.d1, |f| jet.first.d1 + f.minus)
    }

    /// The sizes of the terms of `D1 L_d + F-`.
    #[inline(always)]
    pub fn pull_size(&self, jet: &SecondDiscreteJet<N>) -> SVector<f64, N> {
        let size = jet.first.d1.abs();
        self.some().map_or(size, |f| size + f.minus.abs())
    }

    /// The derivative of `D1 L_d + F-` in q0.
    #[inline(always)]
    pub fn pull_in_q0(&self, jet: &SecondDiscreteJet<N>) -> SMatrix<f64, N, N> {
        self.some().map_or(jet.d11, |f| jet.d11 + f.minus_slopes.0)
    }

    /// The derivative of `D1 L_d + F-` in q1.
    #[inline(always)]
    pub fn pull_in_q1(&self, jet: &SecondDiscreteJet<N>) -> SMatrix<f64, N, N> {
        self.some().map_or(jet.d12, |f| jet.d12 + f.minus_slopes.1)
    }

    /// The derivative of `D1 L_d + F-` in z0.
    #[inline(always)]
    pub fn pull_in_z(&self, jet: &SecondDiscreteJet<N>) -> SVector<f64, N> {
        self.some().map_or(jet.d1z, |f| jet.d1z + f.minus_slopes.2)
    }

    /// The momentum at the end of the step, `D2 L_d + F+`.
    #[inline(always)]
    pub fn momentum(&self, jet: &SecondDiscreteJet<N>) -> SVector<f64, N> {
        self.some().map_or(jet.first.d2, |f| jet.first.d2 + f.plus)
    }

    /// Its derivative in q0.
    #[inline(always)]
    pub fn momentum_in_q0(&self, jet: &SecondDiscreteJet<N>) -> SMatrix<f64, N, N> {
        let transposed = jet.d12.transpose();
        self.some().map_or(transposed, |f| transposed + f.plus_slopes.0)
    }

    /// Its derivative in q1.
    #[inline(always)]
    pub fn momentum_in_q1(&self, jet: &SecondDiscreteJet<N>) -> SMatrix<f64, N, N> {
        self.some().map_or(jet.d22, |f| jet.d22 + f.plus_slopes.1)
    }

    /// Its derivative in z0.
    #[inline(always)]
    pub fn momentum_in_z(&self, jet: &SecondDiscreteJet<N>) -> SVector<f64, N> {
        self.some().map_or(jet.d2z, |f| jet.d2z + f.plus_slopes.2)
    }
}
