//! The independent variable of the general step: physical or transformed time.

use crate::numbers::compensated::CompensatedSum;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::saved;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar};

/// The independent variable in which the steps are equal.
pub(crate) trait Parametrization<const N: usize> {
    /// Whether it is the physical time t; the computation of rates is then omitted.
    const PHYSICAL: bool;
    /// The rate `g = dt/dtau`.
    fn rate<T: Scalar>(&self, q: &SVector<T, N>) -> T;
}

/// The physical time t.
pub(crate) struct Physical;

impl<const N: usize> Parametrization<N> for Physical {
    const PHYSICAL: bool = true;
    #[inline(always)]
    fn rate<T: Scalar>(&self, _q: &SVector<T, N>) -> T {
        T::one()
    }
}

/// The transformed time tau that a Lagrangian states.
pub(crate) struct Fictitious<'a, L>(pub &'a L);

impl<const N: usize, L: Lagrangian<N>> Parametrization<N> for Fictitious<'_, L> {
    const PHYSICAL: bool = false;
    #[inline(always)]
    fn rate<T: Scalar>(&self, q: &SVector<T, N>) -> T {
        self.0.dt_dtau(q)
    }
}

/// The additional variables of a step in transformed time.
pub(crate) struct Extension<P> {
    pub transformation: P,
    pub t: CompensatedSum,
    /// The momentum conjugate to t.
    pub p_t: CompensatedSum,
    /// The rates g of the stages.
    pub g: Stages,
}

impl<P> Extension<P> {
    pub fn new(transformation: P, t: f64, p_t: f64) -> Self {
        Extension { transformation, t: t.into(), p_t: p_t.into(), g: Stages::ZERO }
    }
}

/// The state with the compensation terms of its sums.
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
