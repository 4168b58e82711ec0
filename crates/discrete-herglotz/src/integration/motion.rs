//! Quantities of a motion that are computed from its states.

use crate::{DenseStep, StepError};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SVector;

/// A velocity of the motion near a state; `None` stands for the velocity at the start.
pub(crate) type NearbyVelocity<const N: usize> = Option<SVector<f64, N>>;

/// Quantities of a motion that observers compute from its states.
pub(crate) trait Motion<const N: usize> {
    /// The velocity at a state; if several velocities have its momentum, the one close to `near`.
    fn velocity(&self, t: f64, state: &PhasePoint<N>, near: NearbyVelocity<N>) -> Result<SVector<f64, N>, StepError>;

    /// The energy at a state.
    fn energy(&self, t: f64, state: &PhasePoint<N>, near: NearbyVelocity<N>) -> Result<f64, StepError>;

    /// The derivatives `(qdot, pdot, zdot)` at a state.
    fn rates(&self, t: f64, state: &PhasePoint<N>, near: NearbyVelocity<N>) -> Result<PhasePoint<N>, StepError>;

    /// A digest that identifies the run.
    fn fingerprint(&self) -> u64;

    /// The state at a time within the step that starts at `from`, and `sigma_d` from there to that time. The curve of
    /// the whole step, if it is known, is the initial guess.
    fn state_within_step(
        &self,
        from: &(f64, PhasePoint<N>),
        t: f64,
        near: NearbyVelocity<N>,
        curve: Option<&DenseStep<N>>,
    ) -> Result<(PhasePoint<N>, f64), StepError>;
}
