//! Motions of rigid bodies between two attitudes.

use super::run::Prepared;
use super::steps::of_integrator;
use super::{Body, BodyMotion};
use crate::RuntimeError;
use contact_geom::groups::{GroupError, Rotation, Rotations};
use discrete_herglotz::groups::GroupEnds;

impl Body {
    /// The initial angular velocity, in the body, of a motion that ends at an attitude: a reorientation, found by Newton's
    /// method from the angular velocity of the motion. There may be others, with more turns.
    ///
    /// ```
    /// use herglotz_runtime::{AnyIntegrator, Body, BodyMotion, StepControl, Steps};
    /// let body = Body { inertia: Body::principal([1.0, 2.0, 3.0]), gamma: -0.1, ..Body::default() };
    /// let steps = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 4 }, steps: Steps::Count(40) };
    /// let guess = BodyMotion::new([1.0, 0.0, 0.0, 0.0], [0.0, 0.9, 0.0], 2.0, steps);
    /// let omega = body.between(&guess, [0.6, 0.0, 0.8, 0.0])?;
    /// let outcome = body.run(&BodyMotion { omega, ..guess }, &mut ())?;
    /// assert!((outcome.attitude[2].abs() - 0.8).abs() < 1e-12);
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`run`](Self::run); [`RuntimeError::Argument`] for an attitude that is not a unit quaternion, and where no
    /// motion is found.
    pub fn between(&self, motion: &BodyMotion, to: [f64; 4]) -> Result<[f64; 3], RuntimeError> {
        let Prepared { rows, state, steps, integrator, .. } = self.prepare(motion)?;
        let g1 = Rotation::from_quaternion(to)
            .map_err(|error| RuntimeError::argument("to", format!("is refused: {error}")))?;
        let start = state.state();
        let ends = GroupEnds::<Rotations, 3> { t0: motion.t, g0: start.g, g1, z0: start.z, steps };
        let found = ends.search(&integrator, &start.momentum).map_err(|error| match error {
            GroupError::NoMotionBetween { .. } | GroupError::Singular { .. } => {
                RuntimeError::argument("to", format!("is not reached: {error}"))
            }
            error => of_integrator(&error),
        })?;
        Ok(rows.lagrangian.velocity(&found.start.momentum).into())
    }
}
