//! Contact Gauss collocation as an integrator.

use crate::gauss::checks::check_stages;
use crate::gauss::routes::hamiltonian::step_jacobian;
use crate::gauss::routes::transformed::StatedTransformation;
use crate::gauss::{GaussStepper, TransformedStepper};
use crate::integration::{BatchKernel, StepFormula};
use crate::{InputError, Integrator, MethodInfo, Problem, StepError, Stepper, StepperOptions};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{Lagrangian, PhasePoint, TimeTransformation};

/// Contact [`Gauss`](crate::gauss::Gauss) collocation with s = 1 to 16 stages, of order 2s, for every regular
/// Lagrangian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GaussCollocation {
    /// The number of stages.
    pub stages: usize,
}

/// Contact Gauss collocation with equal steps in a transformed time, for autonomous Lagrangians: the steps are short
/// where the motion is fast, and the last step is shortened to end at the end of the time span.
///
/// ```
/// use contact_geom::systems::{Kepler, System};
/// use discrete_herglotz::{Problem, Steps, TransformedGauss, Until};
/// let kepler = Kepler::<2>::default();
/// let problem = Problem::new(&kepler, 0.0, kepler.initial())?;
/// let by = TransformedGauss::with(6, kepler.time_transformation());
/// let outcome = problem.by(by).steps(Steps::Size(0.2)).run(Until::Time(10.0))?;
/// assert!((outcome.t - 10.0).abs() < 1e-14);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TransformedGauss<T = OwnTransformation> {
    /// The number of stages, 1 to 16.
    pub stages: usize,
    /// The time transformation: that of the Lagrangian, or another one.
    pub transformation: T,
}

/// The time transformation that a Lagrangian states ([`Lagrangian::dt_dtau`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OwnTransformation;

impl TransformedGauss {
    /// The method with the time transformation that the Lagrangian states.
    pub fn new(stages: usize) -> Self {
        TransformedGauss { stages, transformation: OwnTransformation }
    }
}

impl<T> TransformedGauss<T> {
    /// The method with a given [`TimeTransformation`].
    pub fn with(stages: usize, transformation: T) -> Self {
        TransformedGauss { stages, transformation }
    }
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

fn check_transformed<L: Lagrangian<N>, const N: usize>(lagrangian: &L, stages: usize) -> Result<(), InputError> {
    check_stages(stages)?;
    if lagrangian.structure().autonomous { Ok(()) } else { Err(InputError::Unclaimed { claim: "autonomous" }) }
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
    ) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
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
        if const { !L::HINTS.time_transformation } {
            check_stages(self.stages)?;
            return Err(InputError::NoTimeTransformation);
        }
        check_transformed(lagrangian, self.stages)
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        _: StepperOptions,
    ) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
        Integrator::<'a, L, N>::check(self, problem.lagrangian)?;
        // The stepper is compiled only for Lagrangians with a time transformation; the check rejects all others.
        if const { L::HINTS.time_transformation } {
            Ok(Box::new(TransformedStepper::new(problem, self.stages, h, StatedTransformation(problem.lagrangian))?))
        } else {
            Err(InputError::NoTimeTransformation)
        }
    }
}

impl<'a, L, T, const N: usize> Integrator<'a, L, N> for TransformedGauss<T>
where
    L: Lagrangian<N>,
    T: TimeTransformation<N> + Clone + 'a,
{
    fn info(&self) -> MethodInfo {
        info(self.stages, true)
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        check_transformed(lagrangian, self.stages)
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        _: StepperOptions,
    ) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
        Ok(Box::new(TransformedStepper::new(problem, self.stages, h, self.transformation.clone())?))
    }
}
