//! The collocation steppers of a Lagrangian, for steps that end on kinks and jumps, and for searches that select the
//! integrator themselves.

use crate::gauss::{CollocationStepper, GaussStepper, TransformedStepper};
use crate::integration::{Bound, SharedIntegrator, SystemProblem};
use crate::{DividedGauss, GaussCollocation, InputError, StepperOptions, TransformedGauss};
use contact_geom::Lagrangian;

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
