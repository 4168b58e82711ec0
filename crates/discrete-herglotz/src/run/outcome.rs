//! What a run has led to.

use crate::Start;
use crate::{Status, UnresolvedStep};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SVector;

/// What a run has led to. Where it was ended before its time, that is what was computed before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome<const N: usize> {
    /// How the run ended.
    pub status: Status,
    /// The first step that cannot have resolved the motion, where one was seen: what follows it may be wrong.
    pub unresolved: Option<UnresolvedStep>,
    /// The steps taken.
    pub steps: usize,
    /// The time reached.
    pub t: f64,
    /// The position there.
    pub q: SVector<f64, N>,
    /// The momentum there.
    pub p: SVector<f64, N>,
    /// The velocity there; `None` where none belongs to the momentum.
    pub v: Option<SVector<f64, N>>,
    /// The action there, where someone asked for it.
    pub z: Option<f64>,
    /// The logarithm of the conformal factor of the motion, where someone asked for it.
    pub log_factor: Option<f64>,
    /// The error of (q, p) relative to its size, or of v relative to the largest speed, whichever is larger, where someone asked for it; see
    /// [`Run::with_error_estimate`](super::Run::with_error_estimate). Where an observer ended the run within a step, that at the step's end.
    pub error_estimate: Option<f64>,
    /// The evaluations of forces or gradients.
    pub evaluations: u64,
    pub(crate) z_or_start: f64,
}

impl<const N: usize> Outcome<N> {
    /// The state `(q, p, z)`; the action is the start's where no one asked for it.
    pub fn state(&self) -> PhasePoint<N> {
        PhasePoint { q: self.q, p: self.p, z: self.z_or_start }
    }
}

/// To go on from there.
impl<const N: usize> From<&Outcome<N>> for Start<N> {
    fn from(outcome: &Outcome<N>) -> Self {
        Start::Momentum(outcome.state(), outcome.v.unwrap_or_else(SVector::zeros))
    }
}
