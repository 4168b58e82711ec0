//! How a run ended, and the first step that does not resolve its motion.

use crate::StepError;

/// A step whose defect is far larger than that of any step that resolves the motion. It may have crossed a pole, a wall
/// or a centre of force without evaluating the force there. Where an accuracy was requested that the last digit of the
/// start forbids, it is the first step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnresolvedStep {
    /// The first such step, counted from 0.
    pub step: usize,
    /// The defect, in units of the largest defect of a step that resolves the motion, or the error in units of the requested
    /// one; larger than one.
    pub defect: f64,
}

impl std::fmt::Display for UnresolvedStep {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let UnresolvedStep { step, defect } = self;
        write!(
            f,
            "step {step} does not resolve the motion (defect {defect:.1e}), and later results may be wrong; take a \
             smaller step, or a shorter time if the motion is chaotic"
        )
    }
}

/// How a run ended. The output recorded before the end is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Status {
    /// All steps were taken, or those until the motion came to rest, where it remains.
    Completed,
    /// An observer ended the run.
    Stopped {
        /// The number of steps taken.
        step: usize,
        /// The time, within the last step or at its end.
        t: f64,
        /// The observer that ended the run.
        by: &'static str,
    },
    /// A claim on the structure of the Lagrangian is false at a state of the run; all results may be wrong.
    FalseClaim {
        /// The number of steps taken.
        step: usize,
        /// The name of the claim, a field of [`Structure`](contact_geom::Structure).
        claim: &'static str,
        /// The size of what the claim says is zero; see [`Defect`](contact_geom::Defect).
        size: f64,
    },
    /// A step failed; the state is that before it.
    Failed {
        /// The number of the step that failed, counted from 0.
        step: usize,
        /// The time that was reached.
        t: f64,
        /// The cause.
        cause: StepError,
    },
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Status::Completed => write!(f, "completed"),
            Status::Stopped { step, t, by } => write!(f, "stopped by {by} at t = {t}, in step {step}"),
            Status::FalseClaim { step, claim, size } => write!(
                f,
                "unreliable: after step {step} the Lagrangian violates the property `{claim}` that it claims (by the \
                 relative size {size:e}); correct its `structure` and run again"
            ),
            Status::Failed { step, t, cause } => write!(f, "failed in step {step} at t = {t}: {cause}"),
        }
    }
}

/// The earlier of two unresolved steps.
pub(crate) fn first(a: Option<UnresolvedStep>, b: Option<UnresolvedStep>) -> Option<UnresolvedStep> {
    a.into_iter().chain(b).min_by_key(|s| s.step)
}
