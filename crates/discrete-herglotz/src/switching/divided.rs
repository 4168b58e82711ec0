//! Contact Gauss collocation with steps that are subdivided where the motion is fast.

use crate::gauss::info;
use crate::integration::SystemProblem;
use crate::switching::stepper::SwitchingStepper;
use crate::switching::stepper::evaluation_range::EvaluationRange;
use crate::switching::stepper::part_stepper::PartStepper;
use crate::switching::{Collocation, CollocationOf};
use crate::{GaussCollocation, InputError, Integrator, MethodInfo, Problem, Stepper, StepperOptions};
use contact_geom::Lagrangian;
use std::sync::Arc;

/// Contact Gauss collocation with adaptive subdivision of its steps.
///
/// A step is divided into parts where the defect of its curve in Herglotz' equations, between the nodes, exceeds a
/// bound: a part is halved until its defect is within the bound, and the next part may be twice as long. Each part is
/// conformally contact, and so is the step. Such steps attain an accuracy where a part of the motion, such as a close
/// encounter, requires much shorter steps than the rest.
///
/// ```
/// use contact_examples::systems::Kepler;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{DividedGauss, Problem, Steps, Until};
/// let (kepler, e) = (Kepler::<2> { gamma: 0.0, mu: 1.0 }, 0.9999);
/// let start = VelocityPoint::new([1.0 + e, 0.0], [0.0, f64::sqrt((1.0 - e) / (1.0 + e))], 0.0);
/// let problem = Problem::new(&kepler, 0.0, start)?;
/// let divided = DividedGauss { stages: 8, max_defect: 1e-6 };
/// let outcome = problem.by(divided).steps(Steps::Count(64)).run(Until::Time(std::f64::consts::TAU))?;
/// assert!((outcome.q[0] - 1.9999).abs() < 1e-6);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DividedGauss {
    /// The number of stages.
    pub stages: usize,
    /// The bound for the defect of a part, relative to its momenta.
    pub max_defect: f64,
}

impl DividedGauss {
    /// The name in tables, which can also be parsed.
    pub(crate) fn name(&self) -> String {
        let DividedGauss { stages, max_defect } = self;
        format!("divided_gauss_{stages}_{max_defect:e}")
    }

    /// The stepper, whose parts also end on kinks and jumps.
    pub(crate) fn run<'a>(
        self,
        collocation: Collocation<'a>,
        problem: &SystemProblem<'a>,
        h: f64,
        options: StepperOptions,
    ) -> Result<SwitchingStepper<'a>, InputError> {
        let make = move |problem: &SystemProblem<'a>, h: f64, _: bool| {
            collocation.stepper(problem, self.stages, h, options).map(PartStepper::Collocation)
        };
        let stepper = SwitchingStepper::new(problem, h, EvaluationRange::Within, Box::new(make))?;
        Ok(stepper.dividing(self.max_defect, options.parts))
    }
}

impl<'a, L: Lagrangian<N>, const N: usize> Integrator<'a, L, N> for DividedGauss {
    fn info(&self) -> MethodInfo {
        let info = info(self.stages, false);
        MethodInfo { name: self.name().into(), divides: true, ..info }
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        let DividedGauss { stages, max_defect } = *self;
        Integrator::<'a, L, N>::check(&GaussCollocation { stages }, lagrangian)?;
        if max_defect > 0.0 && max_defect.is_finite() {
            return Ok(());
        }
        Err(InputError::Hypothesis { hypothesis: "a positive and finite `max_defect`" })
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        options: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        if options.undivided {
            return GaussCollocation { stages: self.stages }.stepper(problem, h, options);
        }
        Ok(Box::new(self.run(Arc::new(CollocationOf(problem.lagrangian)), &problem.of_system(), h, options)?))
    }
}
