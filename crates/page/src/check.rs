//! Whether steps are contact transformations.

use crate::numbers::number;
use crate::request::{Deadline, answer, of_motion};
use crate::run::planned;
use herglotz::Scene;
use herglotz::runtime::{InitialVelocity, Motion, RuntimeError, Start, Status, StepControl, Steps};
use serde_json::{Value, json};

/// The defect of the contact form of the last step of a motion: the step is a contact transformation where it is of the size of
/// round-off.
pub fn check(request: &str) -> Value {
    answer(request, |request| {
        let scene = request.formula("the defect of the contact form")?;
        let motion = Motion { interrupt: Some(Deadline::new().interrupt()), ..scene.bare_motion() };
        let given = request.steps.as_ref().and_then(|(name, count)| Some((name.parse().ok()?, *count)));
        let motion = match given {
            Some((by, count)) => {
                Motion { step_control: StepControl::Steps { by, steps: Steps::Count(count) }, ..motion }
            }
            None => motion,
        };
        let start = motion.start.t;
        let motion = of_last_step(&scene, motion).map_err(of_motion(&scene))?;
        let is_last = motion.start.t != start;
        let check = scene.system.check(&motion, 1).map_err(of_motion(&scene))?;
        let last = check.samples.last();
        Ok(json!({
            "integrator": check.integrator,
            "is_last": is_last,
            "t": last.map(|sample| number(sample.t)),
            "sigma": last.map(|sample| number(sample.sigma)),
            "contact_defect": last.map(|sample| number(sample.contact_defect)),
            "herglotz_defect": last.map(|sample| number(sample.herglotz_defect)),
            "is_contact": check.not_contact.is_none(),
        }))
    })
}

/// The number of steps from which on the last one is not computed again, but the first one is checked: it would take seconds.
const MOST_STEPS: usize = 20_000;

/// The last step of a motion, as a motion; the whole motion where the steps before it do not reach it, or are too many.
fn of_last_step(scene: &Scene, motion: Motion) -> Result<Motion, RuntimeError> {
    let plan = scene.system.plan(&motion)?;
    let Some(StepControl::Steps { by, .. }) = planned(&plan) else { return Ok(motion) };
    let steps = |count| StepControl::Steps { by, steps: Steps::Count(count) };
    let motion = Motion { step_control: steps(plan.steps), ..motion };
    if !(2..MOST_STEPS).contains(&plan.steps) {
        return Ok(motion);
    }
    let before = Motion { end: motion.end - plan.step_size, step_control: steps(plan.steps - 1), ..motion.clone() };
    let outcome = scene.system.run(&before, &mut ())?;
    let (Status::Completed, Some(v), Some(z)) = (outcome.status, outcome.v, outcome.z) else { return Ok(motion) };
    let velocity = InitialVelocity::MomentumNear { p: outcome.p, v };
    Ok(Motion { start: Start { t: outcome.t, q: outcome.q, velocity, z }, step_control: steps(1), ..motion })
}
