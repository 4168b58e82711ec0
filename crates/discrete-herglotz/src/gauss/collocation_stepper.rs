//! Steppers of collocation as runs and searches see them, whatever the Lagrangian.

use crate::Stepper;
use crate::gauss::{DefectSample, GaussRoute, GaussStepper, StepStart, TransformedStepper};

/// A stepper of contact Gauss collocation whose steps can be examined.
pub(crate) trait CollocationStepper: Stepper {
    /// The defect of the last step between its nodes, at a number of sets of points.
    fn sample_defect(&self, sets: usize) -> Option<DefectSample>;

    /// The number of steps that needed Newton's method.
    fn newton_steps(&self) -> u64 {
        0
    }

    /// Whether a step is a multiplication by one matrix.
    fn is_linear(&self) -> bool {
        false
    }

    /// The transformed time since the start; the default is 0.
    fn tau(&self) -> f64 {
        0.0
    }

    /// The compensation terms of its sums, beyond the last digits of the state.
    /// [`set_compensation`](Self::set_compensation) restores them. `None`, the default, where they are not carried over.
    fn compensation(&self) -> Option<StepStart> {
        None
    }

    /// Sets the compensation terms.
    fn set_compensation(&mut self, _rests: &StepStart) {}
}

impl CollocationStepper for GaussStepper<'_> {
    fn sample_defect(&self, sets: usize) -> Option<DefectSample> {
        GaussStepper::sample_defect(self, sets)
    }
    fn newton_steps(&self) -> u64 {
        GaussStepper::newton_steps(self)
    }
    fn is_linear(&self) -> bool {
        self.route() == GaussRoute::Linear
    }
    fn compensation(&self) -> Option<StepStart> {
        Some(GaussStepper::compensation(self))
    }
    fn set_compensation(&mut self, rests: &StepStart) {
        GaussStepper::set_compensation(self, rests);
    }
}

impl CollocationStepper for TransformedStepper<'_> {
    fn sample_defect(&self, sets: usize) -> Option<DefectSample> {
        TransformedStepper::sample_defect(self, sets)
    }
    fn tau(&self) -> f64 {
        TransformedStepper::tau(self)
    }
}
