//! An integrator with the Lagrangian for which it takes steps.

use crate::integration::{Integrator, MethodInfo, StartProjection, StepFormula, StepperOptions, SystemProblem};
use crate::{Components, InputError, Point, State, StepError, Stepper, Vector};
use contact_geom::Lagrangian;
use contact_geom::nalgebra::DMatrix;
use std::sync::Arc;

/// An integrator as runs and searches see it: bound to its Lagrangian. The methods and their defaults are those of
/// [`Integrator`].
pub(crate) trait BoundIntegrator<'a> {
    fn info(&self) -> MethodInfo;

    fn check(&self) -> Result<(), InputError>;

    fn stepper(
        &self,
        problem: &SystemProblem<'a>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError>;

    fn constraint_force(&self, _t: f64, x: &Point) -> Result<Vector, StepError> {
        Ok(Vector::zeros(x.q.len()))
    }

    fn step_formula(&self) -> Option<StepFormula> {
        None
    }

    fn step_jacobian(
        &self,
        _problem: &SystemProblem<'a>,
        _h: f64,
        _step: (f64, &State, &State),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        Ok(None)
    }

    fn step_variation(
        &self,
        _problem: &SystemProblem<'a>,
        _h: f64,
        _step: (f64, &State, &State),
        _parameter: Option<usize>,
        _variation: &mut dyn FnMut(f64, &Point) -> (f64, Components),
    ) -> Result<Option<Components>, StepError> {
        Ok(None)
    }

    fn start_projection(
        &self,
        _problem: &SystemProblem<'a>,
        _parameters: usize,
    ) -> Result<Option<StartProjection>, StepError> {
        Ok(None)
    }
}

/// The integrator of a run, for the lifetime of the Lagrangian.
pub(crate) type SharedIntegrator<'a> = Arc<dyn BoundIntegrator<'a> + 'a>;

/// An integrator with its Lagrangian. A run takes its steppers from it, and so compiles those of no other integrator.
struct Bound<'a, I, L, const N: usize> {
    integrator: I,
    lagrangian: &'a L,
}

/// An integrator for problems of one Lagrangian, as runs see it.
pub(crate) fn bound<'a, I, L, const N: usize>(integrator: I, lagrangian: &'a L) -> SharedIntegrator<'a>
where
    I: Integrator<'a, L, N> + 'a,
    L: Lagrangian<N>,
{
    Arc::new(Bound { integrator, lagrangian })
}

impl<'a, I, L, const N: usize> BoundIntegrator<'a> for Bound<'a, I, L, N>
where
    I: Integrator<'a, L, N>,
    L: Lagrangian<N>,
{
    fn info(&self) -> MethodInfo {
        self.integrator.info()
    }

    fn check(&self) -> Result<(), InputError> {
        self.integrator.check(self.lagrangian)
    }

    fn stepper(
        &self,
        problem: &SystemProblem<'a>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        self.integrator.stepper(&problem.of(self.lagrangian), h, options)
    }

    fn constraint_force(&self, t: f64, x: &Point) -> Result<Vector, StepError> {
        self.integrator.constraint_force(self.lagrangian, t, &x.fixed()).map(Vector::from)
    }

    fn step_formula(&self) -> Option<StepFormula> {
        self.integrator.step_formula()
    }

    fn step_jacobian(
        &self,
        problem: &SystemProblem<'a>,
        h: f64,
        (t, from, to): (f64, &State, &State),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        self.integrator.step_jacobian(&problem.of(self.lagrangian), h, (t, &from.fixed(), &to.fixed()))
    }

    fn step_variation(
        &self,
        problem: &SystemProblem<'a>,
        h: f64,
        (t, from, to): (f64, &State, &State),
        parameter: Option<usize>,
        variation: &mut dyn FnMut(f64, &Point) -> (f64, Components),
    ) -> Result<Option<Components>, StepError> {
        let mut variation = |t: f64, x: &contact_geom::VelocityPoint<N>| {
            let (l, gradient) = variation(t, &x.into());
            (l, gradient.fixed())
        };
        let (problem, step) = (problem.of(self.lagrangian), (t, &from.fixed(), &to.fixed()));
        let found = self.integrator.step_variation(&problem, h, step, parameter, &mut variation)?;
        Ok(found.map(Components::from))
    }

    fn start_projection(
        &self,
        problem: &SystemProblem<'a>,
        parameters: usize,
    ) -> Result<Option<StartProjection>, StepError> {
        self.integrator.start_projection(&problem.of(self.lagrangian), parameters)
    }
}
