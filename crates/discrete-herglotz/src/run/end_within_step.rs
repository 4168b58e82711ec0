//! A run that an observer ends within a step that fails as a whole.

use crate::run::Plan;
use crate::run::findings::Findings;
use crate::run::observers::observer::Observer;
use crate::run::observers::output_request::RunInfo;
use crate::run::observers::step_view::{StepView, Stop};
use crate::{State, Stepper};
use std::ops::ControlFlow;

/// The number of bisections of a failed step: the part of it that can be taken is then known to the round-off of the
/// step.
const MAX_BISECTIONS: usize = 48;

/// The end of the run within the failed step, and the logarithm of the conformal factor there. All observers see the
/// part of the step that contains the end. `None` if no observer ends the run there.
pub(crate) fn end_within_step(
    plan: &Plan<'_>,
    observers: &mut Vec<Box<dyn Observer + '_>>,
    stepper: &dyn Stepper,
    info: RunInfo,
    (findings, taken): (Findings, usize),
) -> Option<(Stop, Option<f64>)> {
    let steps = &plan.steps;
    let (from, near) = ((stepper.time(), stepper.state()), stepper.last_velocity());
    let whole = if steps.info.in_transformed_time { steps.t_end - from.0 } else { steps.h };
    let (mut possible, mut impossible) = (0.0, 1.0);
    let mut ending = None;
    let mut terminal = observers.terminal()?;
    for _ in 0..MAX_BISECTIONS {
        let fraction = 0.5 * (possible + impossible);
        let Ok(part) = steps.step_to(&from, from.0 + fraction * whole, near.as_ref(), None) else {
            impossible = fraction;
            continue;
        };
        // Each part starts at the start of the step, so the observers start anew there.
        terminal.prepare(&info).ok()?;
        if terminal.start(&plan.view(stepper, None, findings, (taken, false))).is_break() {
            return None;
        }
        let seen = terminal.step(&view_of_part(plan, &*part, from.clone(), (findings, taken)));
        if let ControlFlow::Break(stop) = seen {
            ending = stop.at.is_some().then_some(part);
            break;
        }
        possible = fraction;
    }
    drop(terminal);
    let part = ending?;
    let end = view_of_part(plan, &*part, from, (findings, taken));
    let stop = observers.step(&end).break_value()?;
    let t = stop.at.as_ref()?.0;
    let there = end.last_step().and_then(|step| end.within(&step, t).ok());
    Some((stop, there.and_then(|there| there.log_factor)))
}

/// The view of a part of a step for the observers.
fn view_of_part<'r>(
    plan: &'r Plan<'_>,
    part: &'r dyn Stepper,
    from: (f64, State),
    (findings, taken): (Findings, usize),
) -> StepView<'r> {
    let findings = Findings { log_factor: findings.log_factor + part.sigma().ln(), ..findings };
    StepView { in_failed_step: true, ..plan.view(part, Some(from), findings, (taken + 1, false)) }
}
