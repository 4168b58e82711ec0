//! The steppers of an integrator and of Gauss collocation under one interface.

use crate::Stepper;
use crate::gauss::{GaussStepper, StepStart};
use contact_geom::{Lagrangian, numbers::max_or_nan};

/// A type that is, or holds, a stepper.
pub(crate) trait AsStepper<const N: usize> {
    fn stepper(&self) -> &(dyn Stepper<N> + '_);
    fn stepper_mut(&mut self) -> &mut (dyn Stepper<N> + '_);

    /// The compensation terms of its sums, beyond the last digits of the state.
    /// [`set_compensation`](Self::set_compensation) restores them.
    fn compensation(&self) -> StepStart<N> {
        StepStart::ZERO
    }
    fn set_compensation(&mut self, _rests: &StepStart<N>) {}

    /// The largest defect of its last step between the nodes, relative to the momenta; 0 where it is unknown.
    fn defect(&self) -> f64 {
        0.0
    }
}

impl<const N: usize> AsStepper<N> for Box<dyn Stepper<N> + '_> {
    fn stepper(&self) -> &(dyn Stepper<N> + '_) {
        &**self
    }
    fn stepper_mut(&mut self) -> &mut (dyn Stepper<N> + '_) {
        &mut **self
    }
}

impl<L: Lagrangian<N>, const N: usize> AsStepper<N> for GaussStepper<'_, L, N> {
    fn compensation(&self) -> StepStart<N> {
        GaussStepper::compensation(self)
    }
    fn set_compensation(&mut self, rests: &StepStart<N>) {
        GaussStepper::set_compensation(self, rests);
    }
    fn defect(&self) -> f64 {
        self.sample_defect(1).map_or(0.0, |sample| {
            // A jump with vanishing gradients on both sides shows only in the values of L.
            let of_value = if sample.kinetic > 0.0 { sample.of_value / sample.kinetic } else { 0.0 };
            if sample.is_underflown() { of_value } else { max_or_nan(sample.defect, of_value) }
        })
    }

    fn stepper(&self) -> &(dyn Stepper<N> + '_) {
        self
    }
    fn stepper_mut(&mut self) -> &mut (dyn Stepper<N> + '_) {
        self
    }
}
