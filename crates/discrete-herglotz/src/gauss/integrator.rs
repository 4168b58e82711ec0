//! Contact Gauss collocation as an integrator.

use crate::gauss::routes::transformed::OwnTransformation;
use crate::gauss::{GaussStepper, MAX_STAGES, TransformedStepper};
use crate::{InputError, Integrator, MethodInfo, Problem, Stepper, StepperOptions, integration::BatchKernel};
use contact_geom::Lagrangian;

/// Contact [`Gauss`](crate::gauss::Gauss) collocation with s = 1 to 16 stages, of order 2s, for every regular
/// Lagrangian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GaussCollocation {
    /// The number of stages.
    pub stages: usize,
}

/// Contact Gauss collocation with equal steps in transformed time, by the time transformation of an autonomous
/// Lagrangian: the steps are short where the motion is fast, and the last step is shortened to end at the end of the
/// time span.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TransformedGauss {
    /// The number of stages.
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
        divides: false,
        cost_per_evaluation: 1,
        source: "Hairer, Lubich and Wanner, Geometric Numerical Integration (2006), II.1.3, doi:10.1007/3-540-30666-8"
            .into(),
    }
}

fn check_stages(stages: usize) -> Result<(), InputError> {
    if (1..=MAX_STAGES).contains(&stages) { Ok(()) } else { Err(InputError::Stages { found: stages }) }
}

fn check_step(stages: usize, h: f64) -> Result<(), InputError> {
    check_stages(stages)?;
    if h != 0.0 && h.is_finite() { Ok(()) } else { Err(InputError::Step { h }) }
}

impl GaussCollocation {
    /// A stepper by the least expensive route that the Lagrangian's structure allows.
    pub(crate) fn run<'a, L: Lagrangian<N>, const N: usize>(
        self,
        problem: &Problem<'a, L, N>,
        h: f64,
        StepperOptions { action, watched }: StepperOptions,
    ) -> Result<GaussStepper<'a, L, N>, InputError> {
        let Problem { lagrangian, t0, start, state, structure, .. } = *problem;
        check_step(self.stages, h)?;
        let run = GaussStepper::new(lagrangian, (self.stages, h), Some(structure), t0, state, start.v, action)?;
        Ok(if watched { run.with_suspects() } else { run })
    }
}

impl TransformedGauss {
    /// A stepper with the Lagrangian's own time transformation.
    pub(crate) fn run<'a, L: Lagrangian<N>, const N: usize>(
        self,
        problem: &Problem<'a, L, N>,
        h: f64,
    ) -> Result<TransformedStepper<'a, L, OwnTransformation<'a, L>, N>, InputError> {
        let Problem { lagrangian, t0, start, state, structure, .. } = *problem;
        check_step(self.stages, h)?;
        TransformedStepper::new(
            lagrangian,
            (self.stages, h),
            OwnTransformation(lagrangian),
            Some(structure),
            t0,
            state,
            start.v,
        )
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
    ) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
        Ok(Box::new(self.run(problem, h, options)?))
    }

    fn batch_kernel(&self) -> Option<BatchKernel> {
        Some(BatchKernel::Gauss { stages: self.stages })
    }
}

impl<'a, L: Lagrangian<N>, const N: usize> Integrator<'a, L, N> for TransformedGauss {
    fn info(&self) -> MethodInfo {
        info(self.stages, true)
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        check_stages(self.stages)?;
        if const { !L::HINTS.time_transformation } {
            return Err(InputError::Hypothesis {
                hypothesis: "a Lagrangian that declares a time transformation (`Hints::time_transformation`, \
                             `dt_dtau`)",
            });
        }
        if lagrangian.structure().autonomous { Ok(()) } else { Err(InputError::Unclaimed { claim: "autonomous" }) }
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        _: StepperOptions,
    ) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
        Integrator::<'a, L, N>::check(self, problem.lagrangian)?;
        // Compiled only for Lagrangians with a time transformation; the check rejects all others.
        if const { L::HINTS.time_transformation } {
            Ok(Box::new(self.run(problem, h)?))
        } else {
            Err(InputError::NoIntegrator)
        }
    }
}
