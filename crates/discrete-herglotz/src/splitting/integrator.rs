//! Splitting schemes as integrators.

use super::separable::SeparableForm;
use super::velocity_drag::check_force;
use super::{ActionSplitting, DragSplitting, Splitting};
use crate::SplittingScheme;
use crate::integration::{BatchKernel, StepFormula};
use crate::{InputError, Integrator, MethodInfo, Problem, Stepper, StepperOptions};
use contact_geom::Lagrangian;
use std::borrow::Cow;

/// For Lagrangians `v.Mv/2 - V(t, q) + f(z)`; a Runge-Kutta-Nyström scheme requires `f(z) = gamma z`.
impl<'a, L: Lagrangian<N>, const N: usize> Integrator<'a, L, N> for SplittingScheme {
    fn info(&self) -> MethodInfo {
        MethodInfo {
            name: Cow::Borrowed(self.name()),
            order: self.order(),
            symmetric: true,
            explicit: true,
            exact_rate: true,
            in_transformed_time: false,
            collocation: None,
            substeps: true,
            constrained: false,
            contact: true,
            divides: false,
            cost_per_evaluation: 4,
            source: Cow::Borrowed(self.source()),
        }
    }

    fn check(&self, lagrangian: &L) -> Result<(), InputError> {
        let structure = lagrangian.structure();
        if !structure.separable {
            return Err(InputError::Unclaimed { claim: "separable" });
        }
        // The third flow, that of f(z), violates the hypothesis of Runge-Kutta-Nyström methods.
        if self.is_nystrom() && !structure.is_affine_in_z() {
            return Err(InputError::Unclaimed { claim: "z_affine" });
        }
        check_force(lagrangian, self.is_nystrom())
    }

    fn stepper(
        &self,
        problem: &Problem<'a, L, N>,
        h: f64,
        StepperOptions { action, check_resolution, .. }: StepperOptions,
    ) -> Result<Box<dyn Stepper + 'a>, InputError> {
        let Problem { lagrangian, t0, state, structure, .. } = *problem;
        if !structure.is_affine_in_z() {
            let splitting = ActionSplitting::new(lagrangian, self, h, t0, state)?.compensated_where_tiny();
            return Ok(Box::new(if check_resolution { splitting.with_suspects() } else { splitting }));
        }
        // The problem has already verified the claims of its Lagrangian.
        let form = SeparableForm::read_of(lagrangian, h, t0, &state, true)?;
        if const { L::HINTS.forced } && !lagrangian.force_structure().is_of_positions() {
            let splitting = DragSplitting::of(form, self, h, t0, state)?;
            let splitting = if check_resolution { splitting.with_resolution_check() } else { splitting };
            return Ok(Box::new(if action { splitting } else { splitting.without_action() }));
        }
        let splitting = Splitting::of(form, self, h, t0, state)?.compensated_where_tiny();
        let splitting = if check_resolution { splitting.with_resolution_check() } else { splitting };
        Ok(Box::new(if action { splitting } else { splitting.without_action() }))
    }

    fn batch_kernel(&self) -> Option<BatchKernel> {
        Some(BatchKernel::Splitting(*self))
    }

    fn step_formula(&self) -> Option<StepFormula> {
        Some(StepFormula::Splitting(*self))
    }
}
