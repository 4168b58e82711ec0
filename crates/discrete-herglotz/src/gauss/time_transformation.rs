//! The times that the general step can be taken in.

use super::compensated::Compensated;
use super::stages::Stages;
use crate::run::saved::saved;
use contact_geom::nalgebra::SVector;
use contact_geom::{Clock, Scalar};

/// The time that steps are equal in.
pub(super) trait TimeTransformation<const N: usize> {
    /// Whether it is t itself: nothing is computed for it then.
    const PHYSICAL: bool;
    /// The rate `g = dt/dtau`.
    fn rate<T: Scalar>(&self, q: &SVector<T, N>) -> T;
}

/// The time t.
pub(super) struct Physical;

impl<const N: usize> TimeTransformation<N> for Physical {
    const PHYSICAL: bool = true;
    #[inline(always)]
    fn rate<T: Scalar>(&self, _q: &SVector<T, N>) -> T {
        T::one()
    }
}

/// The time of a clock.
pub(super) struct Fictitious<C>(pub C);

impl<const N: usize, C: Clock<N>> TimeTransformation<N> for Fictitious<C> {
    const PHYSICAL: bool = false;
    #[inline(always)]
    fn rate<T: Scalar>(&self, q: &SVector<T, N>) -> T {
        self.0.rate(q)
    }
}

/// What the time of a clock adds to a step.
pub(super) struct Extension<P> {
    pub transformation: P,
    pub t: Compensated,
    /// The momentum of t.
    pub p_t: Compensated,
    /// The rates g of the stages.
    pub g: Stages,
}

impl<P> Extension<P> {
    pub fn new(transformation: P, t: f64, p_t: f64) -> Self {
        Extension { transformation, t: t.into(), p_t: p_t.into(), g: Stages::ZERO }
    }
}

/// The state with what is carried of it.
#[derive(Clone, Copy)]
pub(super) struct Values<const N: usize> {
    pub q: [Compensated; N],
    pub p: [Compensated; N],
    pub z: Compensated,
    pub t: Compensated,
    pub p_t: Compensated,
    pub one_minus_rho: f64,
}

saved!([P] Extension<P> { t, p_t, g });
