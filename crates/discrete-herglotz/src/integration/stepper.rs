//! Steppers: a method applied to one motion.

use crate::integration::{Piece, Reset};
use crate::integration::{SolvedPart, SolvedStages};
use crate::{DenseStep, PlanEntry, State, StepError, UnresolvedStep, Vector};
use thiserror::Error;

/// A method applied to one motion: the current state, the workspace, and the data carried from one step to the next
/// (initial guesses, compensation terms, a kick shared by two steps).
///
/// A run advances a stepper. [`Flow`](crate::rules::Flow) is the stepper of a
/// [`DiscreteLagrangian`](crate::DiscreteLagrangian); methods that carry more than a guess of the velocity have their
/// own.
pub trait Stepper {
    /// Takes `steps` steps without observation between them.
    ///
    /// # Errors
    /// [`StepFailure`] where a step fails: the state is then that before the failed step.
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure>;

    /// Takes `steps` steps, or fewer if a method in transformed time reaches the time `t_end` before; returns their
    /// number. Methods with steps of constant length ignore `t_end`.
    ///
    /// # Errors
    /// As [`advance`](Self::advance).
    fn advance_until(&mut self, steps: usize, t_end: f64) -> Result<usize, StepFailure> {
        let _ = t_end;
        self.advance(steps).map(|()| steps)
    }

    /// The state `(q, p, z)`. For a stepper without the action, `z` keeps its initial value.
    fn state(&self) -> State;

    /// The time of the state.
    fn time(&self) -> f64;

    /// `sigma_d` of the last step; 1 before the first.
    fn sigma(&self) -> f64;

    /// The number of evaluations of forces, or of gradients of L, since the start: one per point of R x TQ x R.
    fn evaluations(&self) -> u64;

    /// The dense output of the last step, for a method that provides it; `None` before the first step and after a
    /// failed one.
    fn dense(&self) -> Option<DenseStep> {
        None
    }

    /// The solved stages of the last step, from which its tangent is computed; `None` before the first step, after a
    /// failed one, and for a method whose tangent is not implemented.
    fn solved_stages(&self) -> Option<SolvedStages> {
        None
    }

    /// The parts into which switching times and breaks divided the last step; empty if it was not divided or the
    /// [stages](Self::solved_stages) of a part are unknown.
    fn solved_parts(&self) -> Vec<SolvedPart> {
        Vec::new()
    }

    /// A velocity of the motion in its last step, from which Newton's method finds the velocity at the state where
    /// several velocities have the same momentum. `None` before the first step, and where the velocity is unique.
    fn last_velocity(&self) -> Option<Vector> {
        None
    }

    /// Takes the initial guess of the first step from the dense output of a longer step with the same initial state.
    /// This affects only the number of iterations.
    fn guess(&mut self, _longer: &DenseStep) {}

    /// Whether `sigma_d` is known in advance to be the same in all steps.
    fn has_constant_rate(&self) -> bool {
        false
    }

    /// Plan entries: what a step computes and skips. The one for the action is used if the action is not requested.
    fn work_summary(&self) -> Vec<PlanEntry> {
        Vec::new()
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

    /// The resets in the steps of the last call of [`advance`](Self::advance), in their order.
    fn resets(&self) -> &[Reset] {
        &[]
    }

    /// The pieces of the last step between its resets; empty for a step without resets.
    fn pieces(&self) -> &[Piece] {
        &[]
    }

    /// Whether a reset so far was not conformally contact, so that the energy changed by an unknown amount.
    fn has_changed_energy(&self) -> bool {
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

/// A failed step among the requested ones.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("halted after {taken} steps: {cause}")]
pub struct StepFailure {
    /// The number of steps taken before the failure.
    pub taken: usize,
    /// The cause of the failure.
    pub cause: StepError,
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
