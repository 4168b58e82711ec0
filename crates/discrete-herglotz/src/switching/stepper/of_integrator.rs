//! The steps of a given integrator, with parts that end on kinks and jumps.

use crate::gauss::Gauss;
use crate::switching::stepper::SwitchingStepper;
use crate::switching::stepper::evaluation_range::EvaluationRange;
use crate::{GaussCollocation, InputError, Integrator, Problem, Stepper, StepperOptions};
use contact_geom::Lagrangian;
use std::sync::Arc;

/// A fraction of a step that exceeds the round-off of its ends.
const END_EXTENSION: f64 = 1e-9;

/// A bound for the distance by which negative substeps make a composition leave its step, in units of the step.
const SUBSTEP_EXTENSION: f64 = 0.5;

/// The highest order of the parts, which are steps of Gauss collocation.
const MAX_PART_ORDER: u32 = 2 * Gauss::<()>::STAGES as u32;

/// The stepper of an integrator with steps that end on kinks and jumps.
///
/// An integrator that evaluates L at the ends of its steps, or beyond, would mix both sides of a surface there. The
/// parts of its steps, and its steps near a surface, are therefore taken by contact Gauss collocation of the same
/// order.
pub(crate) fn of_integrator<'a, L: Lagrangian<N>, const N: usize>(
    integrator: Arc<dyn Integrator<'a, L, N> + 'a>,
    problem: &Problem<'a, L, N>,
    h: f64,
    options: StepperOptions,
) -> Result<Box<dyn Stepper<N> + 'a>, InputError> {
    let info = integrator.info();
    let within = info.collocation.is_some() || info.order > MAX_PART_ORDER;
    let range = match (within, info.substeps) {
        (true, _) => EvaluationRange::Within,
        (false, true) => EvaluationRange::Extended(SUBSTEP_EXTENSION),
        (false, false) => EvaluationRange::Extended(END_EXTENSION),
    };
    let parts = GaussCollocation { stages: (info.order.div_ceil(2) as usize).clamp(1, Gauss::<()>::STAGES) };
    let make = move |problem: &Problem<'a, L, N>, h: f64, is_part: bool| {
        if is_part && !within { parts.stepper(problem, h, options) } else { integrator.stepper(problem, h, options) }
    };
    Ok(Box::new(SwitchingStepper::new(problem, h, range, make)?))
}
