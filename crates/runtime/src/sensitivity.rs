//! Derivatives of motions.

use discrete_herglotz::sensitivity::SensitivityError;
use discrete_herglotz::{Status, UnresolvedStep};

/// A state of a motion, or the derivative of one.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionState {
    /// The time; for a derivative 0.
    pub t: f64,
    /// The position.
    pub q: Vec<f64>,
    /// The velocity; NaN where no velocity corresponds to the momentum.
    pub v: Vec<f64>,
    /// The momentum.
    pub p: Vec<f64>,
    /// The action.
    pub z: f64,
}

/// The partial derivatives of a number in a state of a motion; those in the velocity and in the momentum are added.
#[derive(Clone, Debug, PartialEq)]
pub struct StateCovector {
    /// In the time. It counts at the end of a motion only: other times are fixed.
    pub t: f64,
    /// In the position.
    pub q: Vec<f64>,
    /// In the velocity.
    pub v: Vec<f64>,
    /// In the momentum.
    pub p: Vec<f64>,
    /// In the action.
    pub z: f64,
}

impl StateCovector {
    /// No dependence on a state of n coordinates.
    pub fn zero(n: usize) -> Self {
        StateCovector { t: 0.0, q: vec![0.0; n], v: vec![0.0; n], p: vec![0.0; n], z: 0.0 }
    }
}

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
    pub rows: Vec<Vec<MotionState>>,
    /// The largest derivative along the motion divided by the largest one at its end, at least one: round-off of the
    /// derivatives is amplified by it.
    pub growth: f64,
}

/// The gradient of a number with respect to the variables of a motion; see [`System::gradient`](crate::System::gradient).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Gradient {
    /// In the initial position.
    pub q: Vec<f64>,
    /// In the initial velocity, or in the initial momentum where that was given.
    pub velocity: Vec<f64>,
    /// In the initial action.
    pub z: f64,
    /// In the parameters, in their order.
    pub parameters: Vec<f64>,
    /// In the initial time, for a fixed final time and a fixed number of steps.
    pub t0: f64,
    /// In the final time, for a fixed number of steps.
    pub t_end: f64,
    /// The largest derivative along the motion divided by the one at its start, at least one: round-off of the gradient
    /// is amplified by it.
    pub growth: f64,
}

/// A number that depends on a motion, with its gradient.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LossGradient {
    /// How the motion ended.
    pub status: Status,
    /// The value and the gradient; `None` where the motion was not completed.
    pub loss: Option<(f64, Gradient)>,
}

/// A function of states of a motion: its value, and its partial derivatives in each of them.
pub type Loss<'l> = dyn FnMut(&[MotionState]) -> (f64, Vec<StateCovector>) + 'l;

/// The message on a motion without derivatives, without Rust names.
pub(crate) fn in_words(error: &SensitivityError) -> String {
    match error {
        SensitivityError::Input(error) => crate::in_words(error),
        SensitivityError::NoTangent { method, case } => format!(
            "derivatives of motions by {method}{case} are not implemented; Gauss methods such as \"gauss_8\" have those in all \
             variables, splittings and quadrature rules such as \"strang\" and \"midpoint\" in most, the latter for a Lagrangian \
             without kinks, jumps and resets along the motion"
        ),
        error => error.to_string(),
    }
}
