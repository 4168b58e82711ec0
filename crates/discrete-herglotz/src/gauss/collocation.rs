//! Collocation steppers as runs and searches see them, whatever the Lagrangian.

use crate::gauss::{DefectSample, GaussRoute, GaussStepper, StepStart, TransformedStepper};
use crate::integration::{Bound, SharedIntegrator, SystemProblem};
use crate::{DividedGauss, GaussCollocation, InputError, Stepper, StepperOptions, TransformedGauss};
use contact_geom::Lagrangian;

/// A stepper of contact Gauss collocation whose steps can be examined.
pub(crate) trait CollocationStepper<const N: usize>: Stepper<N> {
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
    /// [`set_compensation`](Self::set_compensation) restores them.
    fn compensation(&self) -> StepStart<N> {
        StepStart::ZERO
    }

    /// Sets the compensation terms.
    fn set_compensation(&mut self, _rests: &StepStart<N>) {}
}

impl<L: Lagrangian<N>, const N: usize> CollocationStepper<N> for GaussStepper<'_, L, N> {
    fn sample_defect(&self, sets: usize) -> Option<DefectSample> {
        GaussStepper::sample_defect(self, sets)
    }
    fn newton_steps(&self) -> u64 {
        GaussStepper::newton_steps(self)
    }
    fn is_linear(&self) -> bool {
        self.route() == GaussRoute::Linear
    }
    fn compensation(&self) -> StepStart<N> {
        GaussStepper::compensation(self)
    }
    fn set_compensation(&mut self, rests: &StepStart<N>) {
        GaussStepper::set_compensation(self, rests);
    }
}

impl<L: Lagrangian<N>, const N: usize> CollocationStepper<N> for TransformedStepper<'_, L, N> {
    fn sample_defect(&self, sets: usize) -> Option<DefectSample> {
        TransformedStepper::sample_defect(self, sets)
    }
    fn tau(&self) -> f64 {
        TransformedStepper::tau(self)
    }
}

/// The collocation steppers of a Lagrangian, for steps that end on kinks and jumps, and for searches that select the
/// integrator themselves. A program that needs neither does not compile them.
pub(crate) trait CollocationSteppers<'a, const N: usize> {
    /// A stepper with equal steps.
    ///
    /// # Errors
    /// Those of [`GaussStepper::new`].
    fn stepper(
        &'a self,
        problem: &SystemProblem<'a, N>,
        stages: usize,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn CollocationStepper<N> + 'a>, InputError>;

    /// A stepper with equal steps in the transformed time of the Lagrangian.
    ///
    /// # Errors
    /// [`InputError::NoTimeTransformation`] where it has none; those of [`TransformedStepper::new`].
    fn transformed_stepper(
        &'a self,
        problem: &SystemProblem<'a, N>,
        stages: usize,
        h: f64,
    ) -> Result<Box<dyn CollocationStepper<N> + 'a>, InputError>;

    /// [`GaussCollocation`] as the integrator of a run.
    fn gauss(&'a self, stages: usize) -> SharedIntegrator<'a, N>;

    /// [`TransformedGauss`] as the integrator of a run.
    fn transformed_gauss(&'a self, stages: usize) -> SharedIntegrator<'a, N>;

    /// [`DividedGauss`] as the integrator of a run.
    fn divided_gauss(&'a self, divided: DividedGauss) -> SharedIntegrator<'a, N>;
}

/// The collocation steppers of one Lagrangian.
pub(crate) type Collocation<'a, const N: usize> = &'a (dyn CollocationSteppers<'a, N> + 'a);

impl<'a, L: Lagrangian<N> + 'a, const N: usize> CollocationSteppers<'a, N> for L {
    fn stepper(
        &'a self,
        problem: &SystemProblem<'a, N>,
        stages: usize,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn CollocationStepper<N> + 'a>, InputError> {
        Ok(Box::new(GaussStepper::new(&problem.with_lagrangian(self), stages, h, options)?))
    }

    fn transformed_stepper(
        &'a self,
        problem: &SystemProblem<'a, N>,
        stages: usize,
        h: f64,
    ) -> Result<Box<dyn CollocationStepper<N> + 'a>, InputError> {
        if const { L::HINTS.time_transformation } {
            Ok(Box::new(TransformedStepper::new(&problem.with_lagrangian(self), stages, h)?))
        } else {
            Err(InputError::NoTimeTransformation)
        }
    }

    fn gauss(&'a self, stages: usize) -> SharedIntegrator<'a, N> {
        Bound::shared(GaussCollocation { stages }, self)
    }

    fn transformed_gauss(&'a self, stages: usize) -> SharedIntegrator<'a, N> {
        Bound::shared(TransformedGauss { stages }, self)
    }

    fn divided_gauss(&'a self, divided: DividedGauss) -> SharedIntegrator<'a, N> {
        Bound::shared(divided, self)
    }
}
