//! What a stepper knows of its last step.

use crate::integration::{Piece, Reset, SolvedPart, SolvedStages};
use crate::{DenseStep, Vector};

/// What a [`Stepper`](crate::Stepper) knows of its last step beyond the state at its end. Every method has a default.
pub trait StepDetails {
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

    /// The resets in the steps of the last call of [`advance`](crate::Stepper::advance), in their order.
    fn resets(&self) -> &[Reset] {
        &[]
    }

    /// The pieces of the last step, in their order; empty for a step that was not divided.
    fn pieces(&self) -> &[Piece] {
        &[]
    }

    /// Whether a reset so far changed the energy, so that its drift says nothing of the steps.
    fn has_changed_energy(&self) -> bool {
        false
    }
}
