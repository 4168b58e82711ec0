//! Integrators that hear an interrupt.

use crate::Interrupt;
use contact_geom::Scalar;
use contact_geom::groups::{GroupError, LieGroup};
use contact_geom::nalgebra::SVector;
use discrete_herglotz::groups::{GroupIntegrator, GroupState, GroupStep, ParametricGroupIntegrator};
use std::cell::Cell;

/// The number of steps between two queries: some hundred microseconds.
const STEPS_BETWEEN_QUERIES: u32 = 64;

/// An integrator whose steps fail with [`GroupError::Interrupted`] once an interrupt is requested.
pub(super) struct Interruptible<I> {
    pub integrator: I,
    interrupt: Option<Interrupt>,
    /// The number of steps since the last query.
    unqueried: Cell<u32>,
}

impl<I> Interruptible<I> {
    pub fn new(integrator: I, interrupt: Option<&Interrupt>) -> Self {
        Interruptible { integrator, interrupt: interrupt.cloned(), unqueried: Cell::new(0) }
    }

    fn query(&self) -> Result<(), GroupError> {
        let Some(interrupt) = &self.interrupt else { return Ok(()) };
        let unqueried = self.unqueried.get() + 1;
        self.unqueried.set(unqueried % STEPS_BETWEEN_QUERIES);
        if unqueried == STEPS_BETWEEN_QUERIES && interrupt.is_wanted() {
            return Err(GroupError::Interrupted);
        }
        Ok(())
    }
}

impl<G: LieGroup<N>, I: GroupIntegrator<G, N>, const N: usize> GroupIntegrator<G, N> for Interruptible<I> {
    fn step_size(&self) -> f64 {
        self.integrator.step_size()
    }

    fn step_by<T: Scalar>(
        &self,
        h: f64,
        t: f64,
        from: &GroupState<G, N, T>,
        velocity: &SVector<T, N>,
    ) -> Result<GroupStep<N, T>, GroupError> {
        self.query()?;
        self.integrator.step_by(h, t, from, velocity)
    }

    fn velocity(&self, t: f64, from: &GroupState<G, N>) -> Result<SVector<f64, N>, GroupError> {
        self.integrator.velocity(t, from)
    }
}

impl<G, I, const N: usize> ParametricGroupIntegrator<G, N> for Interruptible<I>
where
    G: LieGroup<N>,
    I: ParametricGroupIntegrator<G, N>,
{
    fn parameters(&self) -> Vec<f64> {
        self.integrator.parameters()
    }

    fn step_at<T: Scalar>(
        &self,
        theta: &[T],
        step: (f64, f64),
        from: &GroupState<G, N, T>,
        velocity: &SVector<T, N>,
    ) -> Result<GroupStep<N, T>, GroupError> {
        self.query()?;
        self.integrator.step_at(theta, step, from, velocity)
    }
}
