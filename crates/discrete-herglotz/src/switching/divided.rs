//! Contact Gauss collocation with steps that are divided where the motion is fast.

use super::{Reach, SwitchingStepper};
use crate::gauss::facts;
use crate::{Facts, GaussCollocation, InputError, Integrator, Problem, Stepper, Wants};
use contact_geom::Lagrangian;

/// Contact Gauss collocation, each of whose steps is divided into parts where its curve does not solve Herglotz' equations between the nodes up to
/// a misfit: halved until it does, and twice as long after each part that does. Each part is conformally contact, and so is the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DividedGauss {
    /// The number of stages.
    pub stages: usize,
    /// The largest misfit of a part, relative to its momenta.
    pub most_misfit: f64,
}

impl DividedGauss {
    /// A stepper, which also ends its steps on kinks and jumps.
    pub fn run<'a, L: Lagrangian<N>, const N: usize>(
        self,
        problem: &Problem<'a, L, N>,
        h: f64,
        wants: Wants,
    ) -> Result<impl Stepper<N> + use<'a, L, N>, InputError> {
        let gauss = GaussCollocation { stages: self.stages };
        let make = move |problem: &Problem<'a, L, N>, h: f64, _: bool| gauss.run(problem, h, wants);
        Ok(SwitchingStepper::new(problem, h, Reach::Inside, make)?.dividing(self.most_misfit))
    }
}

impl<'a, L: Lagrangian<N>, const N: usize> Integrator<'a, L, N> for DividedGauss {
    fn facts(&self) -> Facts {
        let facts = facts(self.stages, false);
        Facts { name: format!("divided_{}", facts.name).into(), divides: true, ..facts }
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        Integrator::<'a, L, N>::check(&GaussCollocation { stages: self.stages }, lagrangian)
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        wants: Wants,
    ) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
        Ok(Box::new(self.run(problem, h, wants)?))
    }
}
