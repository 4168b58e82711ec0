//! A motion as observers ask it for what its states do not hold.

use crate::{DenseStep, StepError};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SVector;

/// A velocity of the motion near a state; that of the start where none is known.
pub(crate) type Near<const N: usize> = Option<SVector<f64, N>>;

/// A motion as observers ask it for what its states do not hold.
pub(crate) trait Motion<const N: usize> {
    /// The velocity at a state: the one next to another, where several belong to its momentum.
    fn velocity(&self, t: f64, state: &PhasePoint<N>, near: Near<N>) -> Result<SVector<f64, N>, StepError>;

    /// The energy there.
    fn energy(&self, t: f64, state: &PhasePoint<N>, near: Near<N>) -> Result<f64, StepError>;

    /// The rates `(qdot, pdot, zdot)` there.
    fn rates(&self, t: f64, state: &PhasePoint<N>, near: Near<N>) -> Result<PhasePoint<N>, StepError>;

    /// What tells the run from others.
    fn fingerprint(&self) -> u64;

    /// The state at a time of the step that starts at a time and a state, and `sigma_d` from there to it. The curve of the whole step, if it is
    /// known, spares work.
    fn state_within_step(
        &self,
        from: &(f64, PhasePoint<N>),
        t: f64,
        near: Near<N>,
        curve: Option<&DenseStep<N>>,
    ) -> Result<(PhasePoint<N>, f64), StepError>;
}
