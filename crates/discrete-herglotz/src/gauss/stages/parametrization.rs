//! The times that the general step can be taken in.

use crate::numbers::compensated::CompensatedSum;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::saved;
use contact_geom::nalgebra::SVector;
use contact_geom::{Scalar, TimeTransformation};

/// The time that steps are equal in.
pub(crate) trait Parametrization<const N: usize> {
    /// Whether it is t itself: nothing is computed for it then.
    const PHYSICAL: bool;
    /// The rate `g = dt/dtau`.
    fn rate<T: Scalar>(&self, q: &SVector<T, N>) -> T;
}

/// The time t.
pub(crate) struct Physical;

impl<const N: usize> Parametrization<N> for Physical {
    const PHYSICAL: bool = true;
    #[inline(always)]
    fn rate<T: Scalar>(&self, _q: &SVector<T, N>) -> T {
        T::one()
    }
}

/// The time of a time transformation.
pub(crate) struct Fictitious<C>(pub C);

impl<const N: usize, C: TimeTransformation<N>> Parametrization<N> for Fictitious<C> {
    const PHYSICAL: bool = false;
    #[inline(always)]
    fn rate<T: Scalar>(&self, q: &SVector<T, N>) -> T {
        self.0.rate(q)
    }
}

/// What a transformed time adds to a step.
pub(crate) struct Extension<P> {
    pub transformation: P,
    pub t: CompensatedSum,
    /// The momentum of t.
    pub p_t: CompensatedSum,
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
pub(crate) struct Values<const N: usize> {
    pub q: [CompensatedSum; N],
    pub p: [CompensatedSum; N],
    pub z: CompensatedSum,
    pub t: CompensatedSum,
    pub p_t: CompensatedSum,
    pub one_minus_rho: f64,
}

saved!([P] Extension<P> { t, p_t, g });
