//! The step control of a scene: an accuracy, or an integrator with its steps.

use super::SceneError;
use super::checked::positive;
use super::file::RunTable;
use super::location::Location;
use crate::runtime::{AnyIntegrator, StepControl, Steps};

/// How a motion is advanced.
pub(super) fn step_control(text: &str, run: &Location<RunTable>) -> Result<StepControl, SceneError> {
    let by = run.integrator.as_ref().map(|name| integrator(text, name)).transpose()?;
    let steps = match (&run.step, &run.steps) {
        (Some(_), Some(steps)) => {
            return Err(SceneError::at(
                text,
                steps.span(),
                "give the length `step` or the number `steps` of the steps, not both",
            ));
        }
        (Some(step), None) => Some(Steps::Size(positive(text, step, "step")?)),
        (None, Some(steps)) if **steps == 0 => {
            return Err(SceneError::at(text, steps.span(), "`steps` is 0; it must be at least 1"));
        }
        (None, Some(steps)) => Some(Steps::Count(**steps)),
        (None, None) => None,
    };
    let refuse = |span, message: &str| Err(SceneError::at(text, span, message));
    match (&run.accuracy, by, steps) {
        (Some(accuracy), by, None) => Ok(StepControl::Accuracy { error: positive(text, accuracy, "accuracy")?, by }),
        (None, Some(by), Some(steps)) => Ok(StepControl::Steps { by, steps }),
        (Some(accuracy), _, Some(_)) => {
            refuse(accuracy.span(), "give an `accuracy` or the steps, not both: the accuracy determines the step")
        }
        (None, None, Some(_)) => refuse(
            run.span(),
            "the run has steps but no `integrator`; add one, or give an `accuracy` instead of the steps",
        ),
        (None, Some(_), None) => refuse(run.span(), "the run has neither a `step` nor an `accuracy`; add one of them"),
        (None, None, None) => refuse(
            run.span(),
            "the run has no `accuracy`; add it, as in accuracy = 1e-9, or an `integrator` and a `step`",
        ),
    }
}

/// The integrator of this name.
pub(super) fn integrator(text: &str, name: &Location<String>) -> Result<AnyIntegrator, SceneError> {
    name.parse().map_err(|_| {
        let all: Vec<String> = AnyIntegrator::all().iter().map(ToString::to_string).collect();
        let message = format!("unknown integrator `{}`; `herglotz list integrators` prints the names", **name);
        SceneError::unknown(text, name.span(), name, all.iter().map(String::as_str), message)
    })
}
