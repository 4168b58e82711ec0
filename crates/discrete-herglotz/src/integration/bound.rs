//! An integrator with the Lagrangian for which it takes steps.

use crate::integration::{BatchKernel, Integrator, MethodInfo, StepFormula, StepperOptions, SystemProblem};
use crate::{InputError, StepError, Stepper, System};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{ChartVector, Lagrangian, PhasePoint, VelocityPoint};
use std::sync::Arc;

/// The integrator of a run, for the lifetime of the Lagrangian.
pub(crate) type SharedIntegrator<'a, const N: usize> = Arc<dyn Integrator<'a, dyn System<N> + 'a, N> + 'a>;

/// An integrator with its Lagrangian: an integrator for problems whose Lagrangian has no type. A run takes its steppers
/// from it, and so compiles those of no other integrator.
pub(crate) struct Bound<'a, I, L> {
    integrator: I,
    lagrangian: &'a L,
}

impl<'a, I, L> Bound<'a, I, L> {
    /// The integrator of a run.
    pub fn shared<const N: usize>(integrator: I, lagrangian: &'a L) -> SharedIntegrator<'a, N>
    where
        I: Integrator<'a, L, N> + 'a,
        L: Lagrangian<N>,
    {
        Arc::new(Bound { integrator, lagrangian })
    }
}

impl<'a, I, L, const N: usize> Integrator<'a, dyn System<N> + 'a, N> for Bound<'a, I, L>
where
    I: Integrator<'a, L, N>,
    L: Lagrangian<N>,
{
    fn info(&self) -> MethodInfo {
        self.integrator.info()
    }

    fn check(&self, _system: &(dyn System<N> + 'a)) -> Result<(), InputError> {
        self.integrator.check(self.lagrangian)
    }

    fn stepper(
        &self,
        problem: &SystemProblem<'a, N>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
        self.integrator.stepper(&problem.with_lagrangian(self.lagrangian), h, options)
    }

    fn constraint_force(
        &self,
        _system: &(dyn System<N> + 'a),
        t: f64,
        x: &VelocityPoint<N>,
    ) -> Result<SVector<f64, N>, StepError> {
        self.integrator.constraint_force(self.lagrangian, t, x)
    }

    fn batch_kernel(&self) -> Option<BatchKernel> {
        self.integrator.batch_kernel()
    }

    fn step_formula(&self) -> Option<StepFormula> {
        self.integrator.step_formula()
    }

    fn step_jacobian(
        &self,
        problem: &SystemProblem<'a, N>,
        h: f64,
        step: (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        self.integrator.step_jacobian(&problem.with_lagrangian(self.lagrangian), h, step)
    }

    fn step_variation(
        &self,
        problem: &SystemProblem<'a, N>,
        h: f64,
        step: (f64, &PhasePoint<N>, &PhasePoint<N>),
        variation: &mut dyn FnMut(f64, &VelocityPoint<N>) -> (f64, ChartVector<N>),
    ) -> Result<Option<ChartVector<N>>, StepError> {
        self.integrator.step_variation(&problem.with_lagrangian(self.lagrangian), h, step, variation)
    }
}
