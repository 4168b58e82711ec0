//! Contact Gauss collocation as an integrator.

use crate::gauss::checks::check_stages;
use crate::gauss::routes::hamiltonian::step_jacobian;
use crate::gauss::{GaussStepper, TransformedStepper};
use crate::integration::{BatchKernel, StepFormula};
use crate::{InputError, Integrator, MethodInfo, Problem, StepError, Stepper, StepperOptions};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{Lagrangian, PhasePoint};

/// Contact [`Gauss`](crate::gauss::Gauss) collocation with s = 1 to 16 stages, of order 2s, for every regular
/// Lagrangian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GaussCollocation {
    /// The number of stages.
    pub stages: usize,
}

/// Contact Gauss collocation with equal steps in the transformed time that an autonomous Lagrangian states
/// ([`Lagrangian::dt_dtau`]): the steps are short where the motion is fast, and the last step is shortened to end at the
/// end of the time span.
///
/// ```
/// use contact_examples::systems::{Kepler, System};
/// use discrete_herglotz::{Problem, Steps, TransformedGauss, Until};
/// let kepler = Kepler::<2>::default();
/// let problem = Problem::new(&kepler, 0.0, kepler.initial())?;
/// let by = TransformedGauss { stages: 6 };
/// let outcome = problem.by(by).steps(Steps::Size(0.2)).run(Until::Time(10.0))?;
/// assert!((outcome.t - 10.0).abs() < 1e-14);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TransformedGauss {
    /// The number of stages, 1 to 16.
    pub stages: usize,
}

/// The description of either method.
pub(crate) fn info(stages: usize, in_transformed_time: bool) -> MethodInfo {
    MethodInfo {
        name: format!("{}gauss_{stages}", if in_transformed_time { "transformed_" } else { "" }).into(),
        order: 2 * stages as u32,
        symmetric: true,
        explicit: false,
        exact_rate: false,
        in_transformed_time,
        collocation: Some(stages),
        substeps: false,
        constrained: false,
        contact: true,
        divides: false,
        cost_per_evaluation: 1,
        source: "Hairer, Lubich and Wanner, Geometric Numerical Integration (2006), II.1.3, doi:10.1007/3-540-30666-8"
            .into(),
    }
}

impl<'a, L: Lagrangian<N>, const N: usize> Integrator<'a, L, N> for GaussCollocation {
    fn info(&self) -> MethodInfo {
        info(self.stages, false)
    }

    fn check(&self, _lagrangian: &L) -> Result<(), InputError> {
        check_stages(self.stages)
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        Ok(Box::new(GaussStepper::new(problem, self.stages, h, options)?))
    }

    fn batch_kernel(&self) -> Option<BatchKernel> {
        // The batch evaluates L.
        if const { L::HINTS.hamiltonian } { None } else { Some(BatchKernel::Gauss { stages: self.stages }) }
    }

    /// For a Lagrangian that is given by a contact Hamiltonian; all others have their tangents from the solved stages.
    fn step_formula(&self) -> Option<StepFormula> {
        if const { L::HINTS.hamiltonian } { Some(StepFormula::Collocation { stages: self.stages }) } else { None }
    }

    fn step_jacobian(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        (t, start, _): (f64, &PhasePoint<N>, &PhasePoint<N>),
    ) -> Result<Option<DMatrix<f64>>, StepError> {
        if const { L::HINTS.hamiltonian } {
            step_jacobian(problem, self.stages, h, (t, start)).map(Some)
        } else {
            Ok(None)
        }
    }
}

impl<'a, L: Lagrangian<N>, const N: usize> Integrator<'a, L, N> for TransformedGauss {
    fn info(&self) -> MethodInfo {
        info(self.stages, true)
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        check_stages(self.stages)?;
        if const { !L::HINTS.time_transformation } {
            return Err(InputError::NoTimeTransformation);
        }
        if lagrangian.structure().autonomous { Ok(()) } else { Err(InputError::Unclaimed { claim: "autonomous" }) }
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        if options.stages.is_some() {
            return GaussCollocation { stages: self.stages }.stepper(problem, h, options);
        }
        Integrator::<'a, L, N>::check(self, problem.lagrangian)?;
        // The stepper is compiled only for Lagrangians with a time transformation; the check rejects all others.
        if const { L::HINTS.time_transformation } {
            Ok(Box::new(TransformedStepper::new(problem, self.stages, h)?))
        } else {
            Err(InputError::NoTimeTransformation)
        }
    }
}
