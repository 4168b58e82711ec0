//! The collocation steppers of a Lagrangian, for steps that end on kinks and jumps, and for searches that select the
//! integrator themselves.

use crate::gauss::checks::check_stages;
use crate::gauss::{CollocationStepper, GaussStepper, TransformedStepper, info};
use crate::integration::{BoundIntegrator, SharedIntegrator, SystemProblem, bound};
use crate::{DividedGauss, GaussCollocation, InputError, StepperOptions, TransformedGauss};
use crate::{MethodInfo, Stepper};
use contact_geom::Lagrangian;
use std::sync::Arc;

/// The collocation steppers of a Lagrangian, for steps that end on kinks and jumps, and for searches that select the
/// integrator themselves. A program that needs neither does not compile them.
pub(crate) trait CollocationSteppers<'a> {
    /// A stepper with equal steps.
    ///
    /// # Errors
    /// Those of [`GaussStepper::new`].
    fn stepper(
        &self,
        problem: &SystemProblem<'a>,
        stages: usize,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn CollocationStepper + 'a>, InputError>;

    /// A stepper with equal steps in the transformed time of the Lagrangian.
    ///
    /// # Errors
    /// [`InputError::NoTimeTransformation`] where it has none; those of [`TransformedStepper::new`].
    fn transformed_stepper(
        &self,
        problem: &SystemProblem<'a>,
        stages: usize,
        h: f64,
    ) -> Result<Box<dyn CollocationStepper + 'a>, InputError>;

    /// [`GaussCollocation`] as the integrator of a run.
    fn gauss(&self, stages: usize) -> SharedIntegrator<'a>;

    /// [`TransformedGauss`] as the integrator of a run.
    fn transformed_gauss(&self, stages: usize) -> SharedIntegrator<'a>;

    /// [`DividedGauss`] as the integrator of a run.
    fn divided_gauss(&self, divided: DividedGauss) -> SharedIntegrator<'a>;
}

/// The collocation steppers of one Lagrangian.
pub(crate) type Collocation<'a> = Arc<dyn CollocationSteppers<'a> + 'a>;

/// The collocation steppers of a Lagrangian with N coordinates.
pub(crate) struct CollocationOf<'a, L, const N: usize>(pub &'a L);

impl<'a, L: Lagrangian<N>, const N: usize> CollocationSteppers<'a> for CollocationOf<'a, L, N> {
    fn stepper(
        &self,
        problem: &SystemProblem<'a>,
        stages: usize,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn CollocationStepper + 'a>, InputError> {
        Ok(Box::new(GaussStepper::new(&problem.of(self.0), stages, h, options)?))
    }

    fn transformed_stepper(
        &self,
        problem: &SystemProblem<'a>,
        stages: usize,
        h: f64,
    ) -> Result<Box<dyn CollocationStepper + 'a>, InputError> {
        if const { L::HINTS.time_transformation } {
            Ok(Box::new(TransformedStepper::new(&problem.of(self.0), stages, h)?))
        } else {
            Err(InputError::NoTimeTransformation)
        }
    }

    fn gauss(&self, stages: usize) -> SharedIntegrator<'a> {
        bound(GaussCollocation { stages }, self.0)
    }

    fn transformed_gauss(&self, stages: usize) -> SharedIntegrator<'a> {
        bound(TransformedGauss { stages }, self.0)
    }

    fn divided_gauss(&self, divided: DividedGauss) -> SharedIntegrator<'a> {
        bound(divided, self.0)
    }
}

/// The collocation steppers of a system that is evaluated at one point at a time.
pub(crate) struct CollocationByPoints;

impl<'a> CollocationSteppers<'a> for CollocationByPoints {
    fn stepper(
        &self,
        problem: &SystemProblem<'a>,
        stages: usize,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn CollocationStepper + 'a>, InputError> {
        Ok(Box::new(GaussStepper::by_points(problem, stages, h, options)?))
    }

    fn transformed_stepper(
        &self,
        _problem: &SystemProblem<'a>,
        _stages: usize,
        _h: f64,
    ) -> Result<Box<dyn CollocationStepper + 'a>, InputError> {
        Err(InputError::NoTimeTransformation)
    }

    fn gauss(&self, stages: usize) -> SharedIntegrator<'a> {
        Arc::new(ByPoints { stages, divided: None })
    }

    /// There is none: trial runs that would select it fail.
    fn transformed_gauss(&self, stages: usize) -> SharedIntegrator<'a> {
        self.gauss(stages)
    }

    fn divided_gauss(&self, divided: DividedGauss) -> SharedIntegrator<'a> {
        Arc::new(ByPoints { stages: divided.stages, divided: Some(divided) })
    }
}

/// [`GaussCollocation`], or [`DividedGauss`], for a system that is evaluated at one point at a time.
struct ByPoints {
    stages: usize,
    divided: Option<DividedGauss>,
}

impl<'a> BoundIntegrator<'a> for ByPoints {
    fn info(&self) -> MethodInfo {
        let info = info(self.stages, false);
        match self.divided {
            Some(divided) => MethodInfo { name: divided.name().into(), divides: true, ..info },
            None => info,
        }
    }

    fn check(&self) -> Result<(), InputError> {
        check_stages(self.stages)
    }

    fn stepper(
        &self,
        problem: &SystemProblem<'a>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        Ok(match self.divided.filter(|_| !options.undivided) {
            Some(divided) => Box::new(divided.run(Arc::new(CollocationByPoints), problem, h, options)?),
            None => Box::new(GaussStepper::by_points(problem, self.stages, h, options)?),
        })
    }
}
