//! Whether steps are contact transformations.

use crate::numbers::number;
use crate::request::{Deadline, answer, of_motion};
use herglotz::runtime::{Motion, StepControl, Steps};
use serde_json::{Value, json};

/// The defect of the contact form of the first step of a motion: the step is a contact transformation where it is of the size of
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
        let check = scene.system.check(&motion, 1).map_err(of_motion(&scene))?;
        let last = check.samples.last();
        Ok(json!({
            "integrator": check.integrator,
            "t": last.map(|sample| number(sample.t)),
            "sigma": last.map(|sample| number(sample.sigma)),
            "contact_defect": last.map(|sample| number(sample.contact_defect)),
            "herglotz_defect": last.map(|sample| number(sample.herglotz_defect)),
            "is_contact": check.not_contact.is_none(),
        }))
    })
}
