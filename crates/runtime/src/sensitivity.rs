//! Derivatives of motions.

use discrete_herglotz::sensitivity::{EndCovector, Gradient, MotionState, SensitivityError, StateDerivative};
use discrete_herglotz::{Status, UnresolvedStep};

/// The derivatives of a motion with respect to variables; see [`System::sensitivity`](crate::System::sensitivity).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Sensitivity {
    /// How the motion ended. Where it was not completed there are rows up to its end only.
    pub status: Status,
    /// The first step that was found not to resolve the motion.
    pub unresolved: Option<UnresolvedStep>,
    /// The state at each time that was reached.
    pub states: Vec<MotionState>,
    /// The derivatives of each of these states, in the order of the variables.
    pub rows: Vec<Vec<StateDerivative>>,
    /// The derivatives of the times of the [sign changes](EventAt) that were given, in the order of the variables.
    pub event_times: Vec<Vec<f64>>,
    /// The largest derivative along the motion divided by the largest one at its end, at least one: round-off of the
    /// derivatives is amplified by it.
    pub growth: f64,
}

/// A sign change of an event of a motion, as a [`Crossing`](crate::Crossing) has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EventAt {
    /// The index of the event.
    pub event: usize,
    /// The time.
    pub t: f64,
}

/// A number that depends on a motion, with its gradient.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LossGradient {
    /// How the motion ended.
    pub status: Status,
    /// The first step that was found not to resolve the motion.
    pub unresolved: Option<UnresolvedStep>,
    /// The value and the gradient; `None` where the motion was not completed.
    pub loss: Option<(f64, Gradient)>,
}

/// A function of states of a motion: its value, and its partial derivatives in each of them.
pub type Loss<'l> = dyn FnMut(&[MotionState]) -> (f64, Vec<EndCovector>) + 'l;

/// The message on a motion without derivatives, without Rust names.
pub(crate) fn in_words(error: &SensitivityError) -> String {
    match error {
        SensitivityError::Input(error) => crate::in_words(error),
        SensitivityError::NoTangent { method, case: "" } => format!(
            "derivatives of motions by {method} are not implemented; Gauss methods such as \"gauss_8\" have those in all \
             variables, and splittings and quadrature rules in most"
        ),
        SensitivityError::NoTangent { method, case } => format!(
            "derivatives of motions by {method}{case} are not implemented; choose a Gauss method such as \"gauss_8\""
        ),
        error => error.to_string(),
    }
}
