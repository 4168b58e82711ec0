//! The results of a case.

use discrete_herglotz::{InputError, StepError};
use exact_lagrangian::ExactError;

/// A result that is right, or for which nothing is claimed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Checked, and right.
    Right,
    /// The step was too long for the motion; runs with shorter steps converge to it.
    Coarse,
    /// Checked as far as possible: there is no reference for the motion, or the motion is so ill-conditioned that there
    /// is no right answer.
    NoReference,
    /// Flagged as unresolved.
    Flagged,
    /// Refused before the first step.
    Refused(&'static str),
    /// Ended with a status.
    Ended(&'static str),
}

/// A result that is wrong.
#[derive(Clone, Debug)]
pub struct Wrong {
    /// The kind of the failure.
    pub kind: Kind,
    /// The details.
    pub what: String,
}

/// The kinds of failures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A panic.
    Panic,
    /// No end within ten seconds.
    Hang,
    /// A result that is infinite or not a number.
    NotFinite,
    /// Runs with shorter steps do not converge to the motion.
    DoesNotConverge,
    /// One step has an error of the size of the motion, and is not flagged.
    UnflaggedStep,
    /// The motion ends before the run does, without a warning.
    BeyondTheEnd,
    /// The error is above ten times the requested accuracy.
    AboveTolerance,
    /// The outputs, or the division of a run, change the result.
    ObservedDiffers,
    /// An equation that the result should solve is not solved.
    Residual,
    /// The contact form is not scaled by the factor that is reported.
    NotConformal,
    /// Two routes to the same result disagree.
    RoutesDiffer,
}

pub type Checked = Result<Verdict, Wrong>;

/// A failure unless a condition holds.
pub fn ensure(holds: bool, kind: Kind, what: impl FnOnce() -> String) -> Result<(), Wrong> {
    if holds { Ok(()) } else { Err(Wrong { kind, what: what() }) }
}

/// The name of an error, for the tally.
pub fn refused(error: &InputError) -> Verdict {
    Verdict::Refused(match error {
        InputError::Step { .. } => "step",
        InputError::Span { .. } => "span",
        InputError::Accuracy { .. } => "accuracy",
        InputError::Times { .. } => "times",
        InputError::Stages { .. } => "stages",
        InputError::TimeTransformation { .. } => "clock",
        InputError::Dimension => "dimension",
        InputError::Count { .. } => "count",
        InputError::Geometry(_) => "geometry",
        InputError::Sigma { .. } => "sigma",
        InputError::EqualPoints => "equal points",
        InputError::Unclaimed { .. } => "unclaimed",
        InputError::FalseClaim { .. } => "false claim",
        InputError::Hypothesis { .. } | InputError::NoTimeTransformation => "hypothesis",
        InputError::FirstStep(_) => "first step",
        _ => "another",
    })
}

/// The name of the failure of a step, for the tally.
pub fn ended(cause: &StepError) -> Verdict {
    Verdict::Ended(match cause {
        StepError::NotConverged { .. } => "not converged",
        StepError::Singular { .. } => "singular",
        StepError::SigmaVanished { .. } => "sigma",
        StepError::OutsideDomain { .. } => "outside the domain",
        StepError::ConjugatePoint { .. } => "conjugate point",
        StepError::NonFinite => "not finite",
        StepError::Event { .. } | StepError::EventUnresolved { .. } => "event",
        _ => "another",
    })
}

/// The name of an error of the exact flow, for the tally.
pub fn exact<const N: usize>(error: &ExactError<N>) -> Verdict {
    match error {
        ExactError::Input(error) => refused(error),
        ExactError::OutsideDomain { .. } => Verdict::Ended("outside the domain"),
        ExactError::Unfinished { .. } => Verdict::Ended("unfinished"),
        ExactError::NotConverged { .. } => Verdict::Ended("not converged"),
        ExactError::ConjugatePoint { .. } => Verdict::Ended("conjugate point"),
        _ => Verdict::Ended("another"),
    }
}
