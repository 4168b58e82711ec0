//! Steppers of contact Gauss collocation from a momentum and a guess of its velocity.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint};
use discrete_herglotz::gauss::{Gauss, GaussStepper, TransformedStepper};
use discrete_herglotz::{DiscreteLagrangian, InputError, Problem, Start, StepperOptions};

/// The steppers of a discrete Lagrangian's method, with its stages and its step.
pub trait GaussSteppers<const N: usize> {
    /// A stepper that computes the action.
    fn stepper(&self, t: f64, state: PhasePoint<N>, v: SVector<f64, N>) -> Result<GaussStepper<'_>, InputError>;

    /// A stepper that computes the action only where it acts on the motion.
    fn stepper_without_action(
        &self,
        t: f64,
        state: PhasePoint<N>,
        v: SVector<f64, N>,
    ) -> Result<GaussStepper<'_>, InputError>;

    /// A stepper with equal steps in transformed time.
    fn transformed_stepper(
        &self,
        t: f64,
        state: PhasePoint<N>,
        v: SVector<f64, N>,
    ) -> Result<TransformedStepper<'_>, InputError>;
}

impl<L: Lagrangian<N>, const N: usize> GaussSteppers<N> for Gauss<L> {
    fn stepper(&self, t: f64, state: PhasePoint<N>, v: SVector<f64, N>) -> Result<GaussStepper<'_>, InputError> {
        let problem = Problem::new(self.lagrangian(), t, Start::Momentum(state, v))?;
        let options = StepperOptions { action: true, ..StepperOptions::default() };
        GaussStepper::new(&problem, self.stages(), DiscreteLagrangian::<N>::step_size(self), options)
    }

    fn stepper_without_action(
        &self,
        t: f64,
        state: PhasePoint<N>,
        v: SVector<f64, N>,
    ) -> Result<GaussStepper<'_>, InputError> {
        let problem = Problem::new(self.lagrangian(), t, Start::Momentum(state, v))?;
        GaussStepper::new(&problem, self.stages(), DiscreteLagrangian::<N>::step_size(self), StepperOptions::default())
    }

    fn transformed_stepper(
        &self,
        t: f64,
        state: PhasePoint<N>,
        v: SVector<f64, N>,
    ) -> Result<TransformedStepper<'_>, InputError> {
        let problem = Problem::new(self.lagrangian(), t, Start::Momentum(state, v))?;
        TransformedStepper::new(&problem, self.stages(), DiscreteLagrangian::<N>::step_size(self))
    }
}
