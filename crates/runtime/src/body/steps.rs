//! The steps and the start of a motion of a rigid body.

use super::BodyMotion;
use super::integrator::{BodyMethod, ForcedBody};
use crate::{RuntimeError, StepControl};
use contact_geom::groups::{GroupError, GroupForce, RigidBody, Rotation, Rotations, UniformGravity};
use contact_geom::nalgebra::SVector;
use discrete_herglotz::groups::{GroupMotion, GroupState, group_steps};
use discrete_herglotz::{AnyIntegrator, InputError, Steps};

/// The number of steps of the first trial run for an accuracy.
const FIRST_STEPS: usize = 8;

impl BodyMotion {
    /// The number of steps and the integrator; for an accuracy, by trial runs, with the bound of the error.
    pub(super) fn steps(
        &self,
        body: &ForcedBody,
        start: &GroupMotion<Rotations, 3>,
    ) -> Result<(AnyIntegrator, usize, Option<f64>), RuntimeError> {
        let is_forced = body.force.acts();
        let span = self.end - self.t;
        if !(span != 0.0 && span.is_finite()) {
            let why = format!(
                "ends at {}, and the motion starts at {}; give a finite end that is later or earlier than the start",
                self.end, self.t
            );
            return Err(RuntimeError::argument("t", why));
        }
        match self.step_control {
            StepControl::Accuracy { error, by } => {
                let by = by.unwrap_or(BodyMethod::default_for(is_forced));
                BodyMethod::check(by, is_forced)?;
                if !(error > 0.0 && error.is_finite()) {
                    return Err(RuntimeError::argument(
                        "accuracy",
                        format!("is {error}; it must be a positive number"),
                    ));
                }
                let method = |h: f64| BodyMethod::integrator(body, by, h, self.interrupt.as_ref());
                let found = group_steps(start, span, error, FIRST_STEPS, method);
                let found = found.map_err(|error| match error {
                    GroupError::Accuracy { .. } | GroupError::Budget { .. } => {
                        RuntimeError::argument("accuracy", format!("is refused: {error}"))
                    }
                    error => of_integrator(&error),
                })?;
                Ok((by, found.steps, Some(found.error)))
            }
            StepControl::Steps { steps: Steps::Count(0), .. } => Err(InputError::NoSteps.into()),
            StepControl::Steps { by, steps } => {
                BodyMethod::check(by, is_forced)?;
                let count = match steps {
                    Steps::Count(count) => count as f64,
                    Steps::Size(h) if h > 0.0 && h.is_finite() => {
                        // A quotient that differs from an integer by rounding only is taken for that integer.
                        (span.abs() / h * (1.0 - 4.0 * f64::EPSILON)).ceil().max(1.0)
                    }
                    Steps::Size(h) => {
                        let why = format!("is {h}; it must be a positive number, since the end gives the direction");
                        return Err(RuntimeError::argument("step", why));
                    }
                };
                // Integers up to here are exact in floating point.
                if count > 9e15 {
                    let why = format!("gives {count:.1e} steps, more than can be counted; take a longer step");
                    return Err(RuntimeError::argument("step", why));
                }
                Ok((by, count as usize, None))
            }
        }
    }

    /// The start, validated.
    pub(super) fn start(
        &self,
        lagrangian: &RigidBody<UniformGravity, 3>,
    ) -> Result<GroupMotion<Rotations, 3>, RuntimeError> {
        if !self.t.is_finite() {
            return Err(RuntimeError::NotFinite { what: "t".into(), value: self.t });
        }
        if !self.z.is_finite() {
            return Err(RuntimeError::NotFinite { what: "z".into(), value: self.z });
        }
        if let Some((i, value)) = self.omega.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            return Err(RuntimeError::NotFinite { what: format!("omega[{i}]"), value: *value });
        }
        let of_attitude = |error: GroupError| RuntimeError::argument("attitude", format!("is refused: {error}"));
        let g = Rotation::from_quaternion(self.attitude).map_err(of_attitude)?;
        let momentum = lagrangian.momentum(&SVector::from(self.omega));
        GroupMotion::new(self.t, GroupState { g, momentum, z: self.z }).map_err(of_attitude)
    }
}

/// The error of an integrator or of its step.
pub(super) fn of_integrator(error: &GroupError) -> RuntimeError {
    let argument = match error {
        GroupError::Interrupted => return InputError::Interrupted.into(),
        GroupError::NeedsComposition { .. } | GroupError::Stages { .. } => "integrator",
        _ => "step",
    };
    RuntimeError::argument(argument, format!("is refused: {error}"))
}
