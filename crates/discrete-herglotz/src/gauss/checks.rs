//! Checks of the number of stages and of the step.

use crate::InputError;
use crate::gauss::tables::coefficients::MAX_STAGES;

/// Checks a number of stages.
pub(crate) fn check_stages(stages: usize) -> Result<(), InputError> {
    if (1..=MAX_STAGES).contains(&stages) { Ok(()) } else { Err(InputError::Stages { found: stages }) }
}

/// Checks a number of stages and a step.
pub(crate) fn check_step(stages: usize, h: f64) -> Result<(), InputError> {
    check_stages(stages)?;
    if h != 0.0 && h.is_finite() { Ok(()) } else { Err(InputError::Step { h }) }
}
