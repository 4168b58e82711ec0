//! Quantities of a motion that are computed from its states.

use crate::integration::Piece;
use crate::run::ResolvedStep;
use crate::{DenseStep, State, StepError, Stepper, Vector};
use contact_geom::nalgebra::DMatrix;

/// A velocity of the motion near a state; `None` stands for the velocity at the start.
pub(crate) type NearbyVelocity<'v> = Option<&'v Vector>;

/// Quantities of a motion that observers compute from its states.
pub(crate) trait Motion {
    /// The velocity at a state; if several velocities have its momentum, the one close to `near`.
    fn velocity(&self, t: f64, state: &State, near: NearbyVelocity<'_>) -> Result<Vector, StepError>;

    /// The inverse of the constant mass matrix M of a separable Lagrangian, whose velocities are `M^-1 p`; `None` for any
    /// other.
    fn inverse_mass(&self) -> Option<&DMatrix<f64>>;

    /// The velocity and the energy at a state.
    fn velocity_and_energy(&self, t: f64, state: &State, near: NearbyVelocity<'_>) -> Result<(Vector, f64), StepError>;

    /// The derivatives `(qdot, pdot, zdot)` at a state.
    fn rates(&self, t: f64, state: &State, near: NearbyVelocity<'_>) -> Result<State, StepError>;

    /// A digest that identifies the run.
    fn fingerprint(&self) -> u64;

    /// The state at a time within the step that starts at `from`, and `sigma_d` from there to that time. The curve of
    /// the whole step, if it is known, is the initial guess.
    fn state_within_step(
        &self,
        from: &(f64, State),
        t: f64,
        near: NearbyVelocity<'_>,
        curve: Option<&DenseStep>,
    ) -> Result<(State, f64), StepError>;

    /// Dense output of the last step of a stepper, with its action where that is followed.
    fn curve(&self, _ends: (&(f64, State), &(f64, State)), stepper: &dyn Stepper) -> Option<DenseStep> {
        stepper.dense()
    }

    /// The motion between the ends of the last step of a stepper, which was not divided, as polynomials; its curve may be
    /// known. `None`, the default, where states within a step are computed by [steps](Self::state_within_step).
    fn resolve(
        &self,
        _ends: (&(f64, State), &(f64, State)),
        _step: (&dyn Stepper, Option<&DenseStep>),
        _near: NearbyVelocity<'_>,
    ) -> Option<ResolvedStep> {
        None
    }

    /// The same for a piece of a step that was divided.
    fn resolve_piece(&self, _piece: &Piece, _near: NearbyVelocity<'_>) -> Option<ResolvedStep> {
        None
    }
}
