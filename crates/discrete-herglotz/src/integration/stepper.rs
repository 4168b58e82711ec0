//! A method at work on one motion.

use crate::{DenseStep, PlanEntry, StepError, UnresolvedStep};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SVector;
use thiserror::Error;

/// A method at work on one motion: its state, its workspace, and what it carries from one step to the next (guesses,
/// compensations, a kick that two steps share).
///
/// This is what a run advances. A [`DiscreteLagrangian`](crate::DiscreteLagrangian) is a function, and a
/// [`Flow`](crate::rules::Flow) a stepper on it; methods that gain by more than a guess of the velocity have a stepper of their own.
pub trait Stepper<const N: usize> {
    /// Takes `steps` steps with nothing observed between them.
    ///
    /// # Errors
    /// [`StepFailure`] where a step cannot be taken: the state is then that before it.
    fn advance(&mut self, steps: usize) -> Result<(), StepFailure>;

    /// Takes `steps` steps, or fewer where a method whose steps vary with a time transformation reaches the time `t_end` before; returns how many.
    /// Steps of one length end where they end.
    ///
    /// # Errors
    /// As [`advance`](Self::advance).
    fn advance_until(&mut self, steps: usize, t_end: f64) -> Result<usize, StepFailure> {
        let _ = t_end;
        self.advance(steps).map(|()| steps)
    }

    /// The state `(q, p, z)`. Where the stepper was told that the action is not requested, `z` stays what it was at the start.
    fn state(&self) -> PhasePoint<N>;

    /// The time of the state.
    fn time(&self) -> f64;

    /// `sigma_d` of the last step; 1 before the first.
    fn sigma(&self) -> f64;

    /// The evaluations of forces, or of gradients of L, since the start: one a point of R x TQ x R.
    fn evaluations(&self) -> u64;

    /// The last step as a curve, for a method that has one of its own; `None` before the first, and after a step that could not be taken.
    fn dense(&self) -> Option<DenseStep<N>> {
        None
    }

    /// A velocity of the motion in its last step: where several belong to a momentum, that at the state is the one from which Newton's method
    /// finds it. `None` before the first step, and where a momentum has no other.
    fn last_velocity(&self) -> Option<SVector<f64, N>> {
        None
    }

    /// Has the first step guessed from the curve of a longer one that has the same start; it changes nothing but the work.
    fn guess(&mut self, _longer: &DenseStep<N>) {}

    /// Whether `sigma_d` is the same in all steps, as it is known before the first.
    fn has_constant_rate(&self) -> bool {
        false
    }

    /// What its steps compute and what they skip, the action among it: as it is where that is not requested.
    fn work_summary(&self) -> Vec<PlanEntry> {
        Vec::new()
    }

    /// Everything of it that changes from step to step, as words, so that it can go on from them to the last bit; `None` where it does not
    /// know how.
    fn save(&self) -> Option<Vec<u64>> {
        None
    }

    /// Goes on from the [saved](Self::save) words of a stepper of the same problem, integrator and step; `false` where they are none.
    fn restore(&mut self, _words: &[u64]) -> bool {
        false
    }

    /// The first step so far that cannot have resolved the motion, where one was seen.
    fn unresolved(&self) -> Option<UnresolvedStep> {
        None
    }

    /// The last steps since the last call that are in doubt: they may not have resolved the motion.
    fn suspect_interval(&mut self) -> Option<SuspectInterval<N>> {
        None
    }
}

/// Steps that ended before the last of them.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("halted after {taken} steps: {cause}")]
pub struct StepFailure {
    /// The steps taken before.
    pub taken: usize,
    /// Why the next could not be taken.
    pub cause: StepError,
}

/// Some steps along which the velocity has turned twice as sharply as in all before them: no fault where the force is smooth, but it may
/// jump there, or be narrower than the steps. A [`Run`](crate::Run) looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SuspectInterval<const N: usize> {
    /// The steps taken before them.
    pub step: usize,
    /// How many they are.
    pub steps: usize,
    /// The time at their start.
    pub t: f64,
    /// The state there.
    pub from: PhasePoint<N>,
    /// The state at their end.
    pub to: PhasePoint<N>,
}
