//! Steppers: a method applied to one motion.

use crate::integration::{Piece, RunSupport, SolvedStages, StepDetails, SuspectInterval};
use crate::{DenseStep, PlanEntry, State, StepError, UnresolvedStep, Vector};
use thiserror::Error;

/// A method applied to one motion: the current state, the workspace, and the data carried from one step to the next
/// (initial guesses, compensation terms, a kick shared by two steps).
///
/// A run advances a stepper. [`Flow`](crate::rules::Flow) is the stepper of a
/// [`DiscreteLagrangian`](crate::DiscreteLagrangian); methods that carry more than a guess of the velocity have their
/// own. The first five methods are enough for a run; a method with dense output, saving or checks of its own implements
/// [`StepDetails`] or [`RunSupport`] as well, and returns itself where the last three return `None`.
pub trait Stepper {
    /// Takes `steps` steps without observation between them.
    ///
    /// # Errors
    /// [`StepFailure`] where a step fails: the state is then that before the failed step.
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure>;

    /// The state `(q, p, z)`. For a stepper without the action, `z` keeps its initial value.
    fn state(&self) -> State;

    /// The time of the state.
    fn time(&self) -> f64;

    /// `sigma_d` of the last step; 1 before the first.
    fn sigma(&self) -> f64;

    /// The number of evaluations of forces, or of gradients of L, since the start: one per point of R x TQ x R.
    fn evaluations(&self) -> u64;

    /// What it knows of its last step, such as dense output.
    fn last_step(&self) -> Option<&dyn StepDetails> {
        None
    }

    /// What a run uses beyond the steps and the state, such as saving.
    fn run_support(&self) -> Option<&dyn RunSupport> {
        None
    }

    /// The same, for the methods that change the stepper.
    fn run_support_mut(&mut self) -> Option<&mut dyn RunSupport> {
        None
    }
}

/// The methods of [`StepDetails`] and [`RunSupport`], with their defaults for a stepper without them.
impl dyn Stepper + '_ {
    /// See [`StepDetails::dense`].
    pub(crate) fn dense(&self) -> Option<DenseStep> {
        self.last_step()?.dense()
    }

    /// See [`StepDetails::solved_stages`].
    pub(crate) fn solved_stages(&self) -> Option<SolvedStages> {
        self.last_step()?.solved_stages()
    }

    /// See [`StepDetails::last_velocity`].
    pub(crate) fn last_velocity(&self) -> Option<Vector> {
        self.last_step()?.last_velocity()
    }

    /// See [`StepDetails::pieces`].
    pub(crate) fn pieces(&self) -> &[Piece] {
        self.last_step().map_or(&[], |step| step.pieces())
    }

    /// See [`RunSupport::advance_until`].
    pub(crate) fn advance_until(&mut self, steps: usize, t_end: f64) -> Result<usize, StepFailure> {
        match self.run_support_mut() {
            Some(run) => run.advance_until(steps, t_end),
            None => self.advance(steps).map(|()| steps),
        }
    }

    /// See [`RunSupport::work_summary`].
    pub(crate) fn work_summary(&self) -> Vec<PlanEntry> {
        self.run_support().map_or_else(Vec::new, |run| run.work_summary())
    }

    /// See [`RunSupport::save`].
    pub(crate) fn save(&self) -> Option<Vec<u64>> {
        self.run_support()?.save()
    }

    /// See [`RunSupport::restore`].
    pub(crate) fn restore(&mut self, words: &[u64]) -> bool {
        self.run_support_mut().is_some_and(|run| run.restore(words))
    }

    /// See [`RunSupport::unresolved`].
    pub(crate) fn unresolved(&self) -> Option<UnresolvedStep> {
        self.run_support()?.unresolved()
    }

    /// See [`RunSupport::suspect_interval`].
    pub(crate) fn suspect_interval(&mut self) -> Option<SuspectInterval> {
        self.run_support_mut()?.suspect_interval()
    }
}

/// A failed step among the requested ones.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("halted after {taken} steps: {cause}")]
pub struct StepFailure {
    /// The number of steps taken before the failure.
    pub taken: usize,
    /// The cause of the failure.
    pub cause: StepError,
}
