//! The steps of a given integrator, with parts that end on kinks and jumps.

use crate::gauss::MAX_STAGES;
use crate::integration::{SharedIntegrator, SystemProblem};
use crate::switching::Collocation;
use crate::switching::stepper::SwitchingStepper;
use crate::switching::stepper::evaluation_range::EvaluationRange;
use crate::switching::stepper::part_stepper::PartStepper;
use crate::{InputError, Stepper, StepperOptions};

/// A fraction of a step that exceeds the round-off of its ends.
const END_EXTENSION: f64 = 1e-9;

/// A bound for the distance by which negative substeps make a composition leave its step, in units of the step.
const SUBSTEP_EXTENSION: f64 = 0.5;

/// The highest order of the parts, which are steps of Gauss collocation.
const MAX_PART_ORDER: u32 = 2 * MAX_STAGES as u32;

/// The stepper of an integrator with steps that end on kinks and jumps.
///
/// An integrator that evaluates L at the ends of its steps, or beyond, would mix both sides of a surface there. The
/// parts of its steps, and its steps near a surface, are therefore taken by contact Gauss collocation of the same
/// order.
pub(crate) fn of_integrator<'a>(
    integrator: SharedIntegrator<'a>,
    collocation: Collocation<'a>,
    problem: &SystemProblem<'a>,
    h: f64,
    options: StepperOptions,
) -> Result<Box<dyn Stepper + 'a>, InputError> {
    let info = integrator.info();
    let within = info.collocation.is_some() || info.order > MAX_PART_ORDER;
    let range = match (within, info.substeps) {
        (true, _) => EvaluationRange::Within,
        (false, true) => EvaluationRange::Extended(SUBSTEP_EXTENSION),
        (false, false) => EvaluationRange::Extended(END_EXTENSION),
    };
    let parts = collocation.gauss((info.order.div_ceil(2) as usize).clamp(1, MAX_STAGES));
    let make = move |problem: &SystemProblem<'a>, h: f64, is_part: bool| {
        let by = if is_part && !within { &parts } else { &integrator };
        by.stepper(problem, h, options).map(PartStepper::Any)
    };
    Ok(Box::new(SwitchingStepper::new(problem, h, range, Box::new(make))?))
}
