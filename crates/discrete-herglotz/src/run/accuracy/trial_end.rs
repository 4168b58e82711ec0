//! The end of a trial run.

use crate::run::accuracy::track::Track;
use crate::{InputError, StepError};

/// The end of a trial run.
#[derive(Clone, Debug)]
pub(crate) enum TrialEnd {
    /// The run reached the end of the span.
    Completed(Track),
    /// A step does not resolve the motion, after this part of the span.
    Unresolved { part: f64 },
    /// The same, with the defect of a narrow feature.
    Narrow { part: f64 },
    /// Another integrator is less expensive.
    SwitchReason(SwitchReason),
    /// A step failed.
    StepFailed { part: f64, cause: StepError },
    /// The budget is exhausted.
    Exhausted,
    /// The run was interrupted.
    Interrupted,
}

/// The less expensive alternative to the steps of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SwitchReason {
    /// Steps in the transformed time of the Lagrangian, of which far fewer are needed.
    TimeTransformation,
    /// Steps of fewer stages, since the present ones need Newton's method.
    FewerStages,
    /// Divided steps where the motion is fast, since the number of equal steps is a large multiple of that required at
    /// the start.
    Divided,
}

impl TrialEnd {
    /// Returns the end itself, or the error by which an interrupt ends the whole search.
    pub fn unless_interrupted(self) -> Result<Self, InputError> {
        if let TrialEnd::Interrupted = self { Err(InputError::Interrupted) } else { Ok(self) }
    }

    /// Sets the span in transformed time.
    pub fn with_tau(self, tau: f64) -> Self {
        if let TrialEnd::Completed(track) = self { TrialEnd::Completed(Track { tau, ..track }) } else { self }
    }

    /// The end of a run whose first step failed, which leads to a refinement; invalid input ends the search.
    pub fn of_failed_start(error: InputError) -> Result<Self, InputError> {
        match error {
            InputError::Sigma { sigma } => {
                Ok(TrialEnd::StepFailed { part: 0.0, cause: StepError::SigmaVanished { sigma } })
            }
            InputError::FirstStep(cause) => Ok(TrialEnd::StepFailed { part: 0.0, cause }),
            invalid => Err(invalid),
        }
    }
}
