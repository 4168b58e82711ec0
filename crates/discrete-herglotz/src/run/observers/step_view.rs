//! The view of a step for observers, and the request of an observer to end the run.

use crate::integration::motion::Motion;
use crate::run::at_rest::RestInterval;
use crate::run::findings::Findings;
use crate::run::observers::last_step::LastStep;
use crate::run::resume_state::ResumeState;
use crate::{Reset, State, StepError, Stepper, Vector};
use contact_geom::nalgebra::DMatrix;

/// The request of an observer to end the run.
#[derive(Clone, Debug, PartialEq)]
pub struct Stop {
    /// The cause, for the status.
    pub by: &'static str,
    /// The error, if the run ends because of one.
    pub cause: Option<StepError>,
    /// The time and the state at which the run ends, within the step that the observer saw; `None` for the end of that
    /// step.
    pub at: Option<(f64, State)>,
}

impl Stop {
    /// Ends the run at the end of the step that the observer saw, with this cause.
    pub fn here(by: &'static str) -> Self {
        Stop { by, cause: None, at: None }
    }

    /// Ends the run because a quantity that the observer requested cannot be computed.
    pub fn failed(cause: StepError) -> Self {
        Stop { by: "", cause: Some(cause), at: None }
    }
}

/// The end of a step, or the start of a run.
pub struct StepView<'r> {
    /// The number of steps taken.
    pub k: usize,
    /// The time.
    pub t: f64,
    /// The state `(q, p, z)`; z is the initial action if the action was not requested.
    pub state: State,
    /// `sigma_d` of the last step, the factor by which it scales the contact form and every momentum of a symmetry; 1
    /// at the start.
    pub sigma: f64,
    /// The logarithm of the conformal factor of the motion since the start, if it was requested.
    pub log_factor: Option<f64>,
    /// Whether the run ends here.
    pub last: bool,
    pub(crate) findings: Findings,
    pub(crate) before: Option<(f64, State)>,
    pub(crate) motion: &'r dyn Motion,
    pub(crate) stepper: &'r dyn Stepper,
    /// Whether the last step is a part of a step that failed as a whole.
    pub(crate) in_failed_step: bool,
    /// If the view is that of an interval of time in which the motion is at rest: no step is taken in it.
    pub(crate) at_rest: Option<RestInterval>,
}

impl<'r> StepView<'r> {
    /// The velocity, by the inverse Legendre transformation of the state.
    ///
    /// # Errors
    /// A [`StepError`] if no velocity has this momentum.
    pub fn velocity(&self) -> Result<Vector, StepError> {
        self.motion.velocity(self.t, &self.state, self.stepper.last_velocity().as_ref())
    }

    /// The inverse of the constant mass matrix M of a separable Lagrangian, whose velocities are `M^-1 p`; `None` for any
    /// other.
    pub fn inverse_mass(&self) -> Option<&'r DMatrix<f64>> {
        self.motion.inverse_mass()
    }

    /// The velocity at another state of the motion.
    ///
    /// # Errors
    /// Those of [`velocity`](Self::velocity).
    pub fn velocity_at(&self, t: f64, state: &State) -> Result<Vector, StepError> {
        self.motion.velocity(t, state, self.stepper.last_velocity().as_ref())
    }

    /// Whether the number of steps is a multiple of `stride` after the step that ends here.
    pub(crate) fn ends_multiple_of(&self, stride: usize) -> bool {
        self.at_rest.is_none() && self.k.is_multiple_of(stride)
    }

    /// Whether the motion has come to rest before: no step is taken any more, and the views are of intervals of time.
    pub fn is_at_rest(&self) -> bool {
        self.at_rest.is_some()
    }

    /// The state from which [`Run::resume`](crate::run::Run::resume) continues the run; `None` if the stepper cannot be
    /// saved, or within a failed step.
    pub fn resume_state(&self) -> Option<ResumeState> {
        if self.in_failed_step {
            return None;
        }
        let (fingerprint, words) = (self.motion.fingerprint(), self.stepper.save()?);
        let Findings { unresolved, energy, .. } = self.findings;
        let (log_factor, rested_until) = (self.log_factor.unwrap_or(0.0), self.at_rest.map(|_| self.t));
        Some(ResumeState { fingerprint, taken: self.k, log_factor, unresolved, energy, rested_until, words })
    }

    /// The view at a time within the last step; see [`LastStep::at`].
    pub(crate) fn within(&self, step: &LastStep<'_>, t: f64) -> Result<Self, StepError> {
        let (state, sigma) = step.step_to(t)?;
        let log_factor = self.log_factor.map(|of_end| match self.at_rest {
            // Over a long time `sigma_d` is below the smallest number.
            Some(RestInterval { rate, .. }) => of_end - rate * (self.t - t),
            None => of_end - self.sigma.ln() + sigma.ln(),
        });
        Ok(StepView { t, state, sigma, log_factor, before: None, ..*self })
    }

    /// The resets in the steps since the last view, in their order.
    pub fn resets(&self) -> &'r [Reset] {
        self.stepper.last_step().map_or(&[], |step| step.resets())
    }

    /// The energy `E_L = v.p - L`.
    ///
    /// # Errors
    /// Those of [`velocity`](Self::velocity).
    pub fn energy(&self) -> Result<f64, StepError> {
        self.velocity_and_energy().map(|(_, energy)| energy)
    }

    /// The velocity and the energy, for the cost of the latter.
    pub(crate) fn velocity_and_energy(&self) -> Result<(Vector, f64), StepError> {
        self.motion.velocity_and_energy(self.t, &self.state, self.stepper.last_velocity().as_ref())
    }

    /// The step that ends here; `None` at the start, and where several steps were taken at once.
    pub fn last_step(&self) -> Option<LastStep<'r>> {
        let from = self.before.clone()?;
        Some(LastStep::new([from, (self.t, self.state.clone())], self.motion, self.stepper))
    }
}
