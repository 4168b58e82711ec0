//! Results of a motion.

use discrete_herglotz::{AnyIntegrator, MethodInfo, PlanEntry, Status, UnresolvedStep};

/// The result of a motion. Where the motion was ended early, it describes the part that was computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub status: Status,
    /// The first step that was found not to resolve the motion.
    pub unresolved: Option<UnresolvedStep>,
    /// The steps taken.
    pub steps: usize,
    /// The time at which the motion came to rest, if it did: no step was taken after it.
    pub rests_from: Option<f64>,
    /// The time reached.
    pub t: f64,
    /// The position there.
    pub q: Vec<f64>,
    /// The momentum there.
    pub p: Vec<f64>,
    /// The velocity there; `None` where no velocity corresponds to the momentum.
    pub v: Option<Vec<f64>>,
    /// The action there, where it was requested.
    pub z: Option<f64>,
    /// The logarithm of the conformal factor, where it was requested.
    pub log_factor: Option<f64>,
    /// The error of (q, p) relative to its size, or of v relative to the largest speed, where it was requested.
    pub error_estimate: Option<f64>,
    /// The evaluations of forces or gradients.
    pub evaluations: u64,
}

/// A sign change of an event.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Crossing {
    /// The time.
    pub t: f64,
    /// The index of the event.
    pub event: usize,
    /// The position there.
    pub q: Vec<f64>,
    /// The velocity; NaN where no velocity corresponds to the momentum.
    pub v: Vec<f64>,
    /// The momentum.
    pub p: Vec<f64>,
    /// The action.
    pub z: f64,
    /// The [columns](crate::Event::columns) of the event; NaN where they are not defined.
    pub columns: Vec<f64>,
    /// The state after the [reset](crate::Event::reset) of the event, if it has one; the state of the crossing
    /// is then that before it.
    pub after: Option<AfterReset>,
}

/// The state after a reset.
#[derive(Clone, Debug, PartialEq)]
pub struct AfterReset {
    /// The position.
    pub q: Vec<f64>,
    /// The velocity; NaN where no velocity corresponds to the momentum.
    pub v: Vec<f64>,
    /// The momentum.
    pub p: Vec<f64>,
    /// The action.
    pub z: f64,
}

/// The plan of a run: what will be computed, and what is skipped.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Plan {
    /// A description in plain text.
    pub text: String,
    /// The properties of the integrator that was named or chosen.
    pub integrator: MethodInfo,
    /// The step, negative where the motion runs backward.
    pub step_size: f64,
    /// The number of steps; none is taken after the motion has come to rest.
    pub steps: usize,
    /// The error that the trial runs measured or predict, where an accuracy was requested.
    pub error: Option<f64>,
    /// The entries of the plan, one for each line of the text.
    pub items: Vec<PlanEntry>,
}

impl Plan {
    /// The integrator by whose name the motion can be repeated with these steps. For a system with constraints, the
    /// names are those of the methods without constraints that stand for them. `None` where it has no name.
    pub fn by(&self) -> Option<AnyIntegrator> {
        let name = self.integrator.name.as_ref();
        match (name.strip_prefix("rattle_"), name.strip_prefix("lobatto_")) {
            (Some(scheme), _) => scheme.parse().ok(),
            (_, Some(stages)) => Some(AnyIntegrator::Gauss { stages: stages.parse::<usize>().ok()?.checked_sub(1)? }),
            _ => name.parse().ok(),
        }
    }
}

/// Callbacks during a motion. Where a callback returns `Break`, the motion ends and all that was recorded is kept.
pub trait RunMonitor {
    /// A recorded row.
    fn row(&mut self, _numbers: &[f64]) -> std::ops::ControlFlow<()> {
        std::ops::ControlFlow::Continue(())
    }

    /// A sign change of an event.
    fn crossing(&mut self, _crossing: &Crossing) -> std::ops::ControlFlow<()> {
        std::ops::ControlFlow::Continue(())
    }

    /// The start, or the end of a step: time, position, velocity, momentum and action. It is called where
    /// [nodes](crate::Motion::nodes) are requested.
    fn node(&mut self, _t: f64, [_q, _v, _p]: [&[f64]; 3], _z: f64) {}

    /// Called every few steps with the completed fraction of the span, from 0 to 1: for progress, and to end a motion
    /// from outside.
    fn poll(&mut self, _part: f64) -> std::ops::ControlFlow<()> {
        std::ops::ControlFlow::Continue(())
    }

    /// Called before each [`poll`](Self::poll): whether the present state is to be passed to [`present`](Self::present).
    fn wants_present(&mut self) -> bool {
        false
    }

    /// The numbers of a row at the present state, where they are [wanted](Self::wants_present); NaN where one is not known.
    fn present(&mut self, _numbers: &[f64]) {}

    /// The state from which a motion that was ended by [`poll`](Self::poll) can be resumed, if its steps can be saved;
    /// those of a [resumable](crate::Motion::resumable) motion can.
    fn interrupted(&mut self, _at: discrete_herglotz::ResumeState) {}

    /// Called after each [`poll`](Self::poll): whether the motion is to be saved there and then continued.
    fn wants_checkpoint(&mut self) -> bool {
        false
    }

    /// The number of steps taken and the state from which the motion can be resumed, where a
    /// [checkpoint](Self::wants_checkpoint) is requested and its steps can be saved. All rows and crossings up to there
    /// have been passed on.
    fn checkpoint(&mut self, _steps: usize, _at: discrete_herglotz::ResumeState) -> std::ops::ControlFlow<()> {
        std::ops::ControlFlow::Continue(())
    }

    /// The same as [`interrupted`](Self::interrupted) for the motion of a [rigid body](crate::Body).
    fn body_interrupted(&mut self, _at: crate::BodyResumeState) {}

    /// The same as [`checkpoint`](Self::checkpoint) for the motion of a [rigid body](crate::Body).
    fn body_checkpoint(&mut self, _steps: usize, _at: crate::BodyResumeState) -> std::ops::ControlFlow<()> {
        std::ops::ControlFlow::Continue(())
    }
}

/// Ignores everything.
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
