//! What a run uses of a stepper beyond its steps.

use crate::{DenseStep, PlanEntry, State, StepFailure, Stepper, UnresolvedStep, Vector};

/// What a [`Run`](crate::Run) uses of a [`Stepper`] beyond its steps and its state: the entries of a plan, saving for a
/// resumed run, the check that the steps resolve the motion, and the end of a run in transformed time. Every method has
/// a default.
pub trait RunSupport: Stepper {
    /// Takes `steps` steps, or fewer if a method in transformed time reaches the time `t_end` before; returns their
    /// number. Methods with steps of constant length ignore `t_end`.
    ///
    /// # Errors
    /// As [`advance`](Stepper::advance).
    fn advance_until(&mut self, steps: usize, t_end: f64) -> Result<usize, StepFailure> {
        let _ = t_end;
        self.advance(steps).map(|()| steps)
    }

    /// Whether `sigma_d` is known in advance to be the same in all steps.
    fn has_constant_rate(&self) -> bool {
        false
    }

    /// Plan entries: what a step computes and skips. The one for the action is used if the action is not requested.
    fn work_summary(&self) -> Vec<PlanEntry> {
        Vec::new()
    }

    /// Takes the initial guess of the first step from the dense output of a longer step with the same initial state.
    /// This affects only the number of iterations.
    fn guess(&mut self, _longer: &DenseStep) {}

    /// Takes a time, a state and its velocity as the start of the next step, which is then bitwise that of a new stepper; `false`
    /// where the steps so far may have changed how further ones are taken.
    fn restart(&mut self, _t: f64, _state: &State, _v: &Vector) -> bool {
        false
    }

    /// All data that change from step to step, as words for a bitwise resume; `None` where saving is not implemented.
    fn save(&self) -> Option<Vec<u64>> {
        None
    }

    /// Restores the [saved](Self::save) words of a stepper of the same problem, integrator and step; `false` where they
    /// are not valid.
    fn restore(&mut self, _words: &[u64]) -> bool {
        false
    }

    /// The first step so far that was flagged as unresolved.
    fn unresolved(&self) -> Option<UnresolvedStep> {
        None
    }

    /// The latest suspect interval since the last call: steps that may not have resolved the motion.
    fn suspect_interval(&mut self) -> Option<SuspectInterval> {
        None
    }
}

/// An interval of steps along which the second difference of the velocity is twice as large as in all steps before. For
/// a smooth force this is harmless, but the force may jump there, or vary on a scale shorter than the steps. A
/// [`Run`](crate::Run) examines the interval.
#[derive(Clone, Debug, PartialEq)]
pub struct SuspectInterval {
    /// The number of steps before the interval.
    pub step: usize,
    /// The number of steps in the interval.
    pub steps: usize,
    /// The time at its start.
    pub t: f64,
    /// The state at its start.
    pub from: State,
    /// The state at its end.
    pub to: State,
}
