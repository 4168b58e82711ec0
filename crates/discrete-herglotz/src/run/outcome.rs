//! The result of a run.

use crate::{Start, State, Status, UnresolvedStep, Vector};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SVector;

/// The result of a run: the final state, or the last state that was computed if the run ended early.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// How the run ended.
    pub status: Status,
    /// The first unresolved step that was detected: the results after it may be wrong.
    pub unresolved: Option<UnresolvedStep>,
    /// The number of steps taken.
    pub steps: usize,
    /// The time at which the motion came to rest, if it did before the run ended: no step was taken after it, and the
    /// state remained the same.
    pub rests_from: Option<f64>,
    /// The final time.
    pub t: f64,
    /// The final position.
    pub q: Vector,
    /// The final momentum.
    pub p: Vector,
    /// The final velocity; `None` if no velocity has this momentum.
    pub v: Option<Vector>,
    /// The final action, if it was requested.
    pub z: Option<f64>,
    /// The logarithm of the conformal factor of the motion, if it was requested.
    pub log_factor: Option<f64>,
    /// The estimated error of (q, p) relative to its size, or of v relative to the largest speed, whichever is larger,
    /// if it was requested; see [`Run::with_error_estimate`](super::Run::with_error_estimate). If an observer ended the
    /// run within a step, the error at the end of that step.
    pub error_estimate: Option<f64>,
    /// The number of evaluations of forces or gradients.
    pub evaluations: u64,
    pub(crate) z_or_start: f64,
}

impl Outcome {
    /// The state `(q, p, z)`; z is the initial action if the action was not requested.
    pub fn state(&self) -> State {
        State { q: self.q.clone(), p: self.p.clone(), z: self.z_or_start }
    }
}

/// The final state as the start of another problem. A problem with another number of coordinates refuses it: its action
/// is then NaN.
impl<const N: usize> From<&Outcome> for Start<N> {
    fn from(outcome: &Outcome) -> Self {
        let z = if outcome.q.len() == N { outcome.z_or_start } else { f64::NAN };
        let state = PhasePoint { q: outcome.q.fixed(), p: outcome.p.fixed(), z };
        Start::Momentum(state, outcome.v.as_ref().map_or_else(SVector::zeros, Vector::fixed))
    }
}
