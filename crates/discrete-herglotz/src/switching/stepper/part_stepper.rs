//! The steppers of parts of steps: those of Gauss collocation, which can be examined, and those of any integrator.

use crate::Stepper;
use crate::gauss::{CollocationStepper, DefectSample, StepStart};
use contact_geom::numbers::max_or_nan;

/// A stepper of parts of steps.
pub(crate) enum PartStepper<'a> {
    Collocation(Box<dyn CollocationStepper + 'a>),
    Any(Box<dyn Stepper + 'a>),
}

impl<'a> PartStepper<'a> {
    pub fn stepper(&self) -> &(dyn Stepper + 'a) {
        match self {
            PartStepper::Collocation(stepper) => &**stepper,
            PartStepper::Any(stepper) => &**stepper,
        }
    }

    pub fn stepper_mut(&mut self) -> &mut (dyn Stepper + 'a) {
        match self {
            PartStepper::Collocation(stepper) => &mut **stepper,
            PartStepper::Any(stepper) => &mut **stepper,
        }
    }

    /// The compensation terms of its sums, beyond the last digits of the state, of n coordinates.
    /// [`set_compensation`](Self::set_compensation) restores them.
    pub fn compensation(&self, n: usize) -> StepStart {
        let known = if let PartStepper::Collocation(stepper) = self { stepper.compensation() } else { None };
        known.unwrap_or_else(|| StepStart::zeros(n))
    }

    pub fn set_compensation(&mut self, rests: &StepStart) {
        if let PartStepper::Collocation(stepper) = self {
            stepper.set_compensation(rests);
        }
    }

    /// The defect of its last step between the nodes, if it is known.
    pub fn sample_defect(&self, sets: usize) -> Option<DefectSample> {
        if let PartStepper::Collocation(stepper) = self { stepper.sample_defect(sets) } else { None }
    }

    /// The largest defect of its last step between the nodes, relative to the momenta; 0 where it is unknown.
    pub fn defect(&self) -> f64 {
        self.sample_defect(1).map_or(0.0, |sample| {
            // A jump with vanishing gradients on both sides shows only in the values of L.
            let of_value = if sample.kinetic > 0.0 { sample.of_value / sample.kinetic } else { 0.0 };
            if sample.is_underflown() { of_value } else { max_or_nan(sample.defect, of_value) }
        })
    }

    /// The number of steps that needed Newton's method.
    pub fn newton_steps(&self) -> u64 {
        if let PartStepper::Collocation(stepper) = self { stepper.newton_steps() } else { 0 }
    }
}
