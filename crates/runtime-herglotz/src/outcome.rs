//! What a motion has led to.

use discrete_herglotz::{MethodInfo, PlanEntry, Status, UnresolvedStep};

/// What a motion has led to. Where it was ended before its time, that is what was computed before.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub status: Status,
    /// The first step that cannot have resolved the motion, where one was seen.
    pub unresolved: Option<UnresolvedStep>,
    /// The steps taken.
    pub steps: usize,
    /// The time reached.
    pub t: f64,
    /// The position there.
    pub q: Vec<f64>,
    /// The momentum there.
    pub p: Vec<f64>,
    /// The velocity there; `None` where none belongs to the momentum.
    pub v: Option<Vec<f64>>,
    /// The action there, where it was asked for.
    pub z: Option<f64>,
    /// The logarithm of the conformal factor, where it was asked for.
    pub log_factor: Option<f64>,
    /// The error of (q, p) relative to its size, or of v relative to the largest speed, where it was asked for.
    pub error_estimate: Option<f64>,
    /// The evaluations of forces or gradients.
    pub evaluations: u64,
}

/// A change of sign of an event.
#[derive(Clone, Debug, PartialEq)]
pub struct Crossing {
    /// The time.
    pub t: f64,
    /// The index of the event.
    pub event: usize,
    /// The position there.
    pub q: Vec<f64>,
    /// The velocity; not a number where none belongs to the momentum.
    pub v: Vec<f64>,
    /// The momentum.
    pub p: Vec<f64>,
    /// The action.
    pub z: f64,
    /// The [columns](crate::Event::columns) of the event; not numbers where they are not defined.
    pub columns: Vec<f64>,
}

/// What will be computed, and what is skipped.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// In words.
    pub text: String,
    /// What is known of the integrator that was named or chosen.
    pub integrator: MethodInfo,
    /// The step, negative where the motion goes back.
    pub step_size: f64,
    /// The number of steps.
    pub steps: usize,
    /// The error that the trial runs found or predict, where an accuracy was asked for.
    pub error: Option<f64>,
    /// The lines of the text.
    pub items: Vec<PlanEntry>,
}

/// What is seen of a motion while it goes on. `Break` ends it, with all that was seen kept.
pub trait RunMonitor {
    /// A recorded row.
    fn row(&mut self, _numbers: &[f64]) -> std::ops::ControlFlow<()> {
        std::ops::ControlFlow::Continue(())
    }

    /// A change of sign of an event.
    fn crossing(&mut self, _crossing: &Crossing) -> std::ops::ControlFlow<()> {
        std::ops::ControlFlow::Continue(())
    }

    /// The end of a step, or the start: time, position, momentum and action; where [nodes](crate::Motion::nodes) are asked for.
    fn node(&mut self, _t: f64, [_q, _v, _p]: [&[f64]; 3], _z: f64) {}

    /// Is called every few steps with the part of the span that is done, from 0 to 1: for progress, and to end a motion from outside.
    fn poll(&mut self, _part: f64) -> std::ops::ControlFlow<()> {
        std::ops::ControlFlow::Continue(())
    }

    /// The motion as it would go on from where [`poll`](Self::poll) has ended it, where its steps can be saved; those of a
    /// [resumable](crate::Motion::resumable) one can.
    fn interrupted(&mut self, _at: discrete_herglotz::ResumeState) {}

    /// Is asked after each [`poll`](Self::poll) whether the motion is to be saved there, and goes on.
    fn wants_checkpoint(&mut self) -> bool {
        false
    }

    /// The motion after so many steps as it would go on from there, where a [checkpoint](Self::wants_checkpoint) is wanted and its steps can
    /// be saved. All rows and crossings up to there were handed on.
    fn checkpoint(&mut self, _steps: usize, _at: discrete_herglotz::ResumeState) -> std::ops::ControlFlow<()> {
        std::ops::ControlFlow::Continue(())
    }
}

/// Nothing is watched.
impl RunMonitor for () {}

/// Keeps the rows of a motion.
#[derive(Default)]
pub(crate) struct KeptRows(pub Vec<Vec<f64>>);

impl RunMonitor for KeptRows {
    fn row(&mut self, numbers: &[f64]) -> std::ops::ControlFlow<()> {
        self.0.push(numbers.to_vec());
        std::ops::ControlFlow::Continue(())
    }
}
