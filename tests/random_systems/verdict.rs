//! What a case may lead to.

use discrete_herglotz::{InputError, StepError};
use exact_lagrangian::ExactError;

/// A result that the library can stand by, or has not claimed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Checked, and right.
    Right,
    /// A step too long for the motion was asked for; shorter ones lead to the motion.
    Coarse,
    /// Checked as far as it goes: there is no reference for the motion, or the motion is so ill-conditioned that there is no
    /// right answer.
    NoReference,
    /// Flagged as unresolved.
    Marked,
    /// Refused before the first step.
    Refused(&'static str),
    /// Ended with a status.
    Ended(&'static str),
}

/// A result that is wrong.
#[derive(Clone, Debug)]
pub struct Wrong {
    /// In what way.
    pub kind: Kind,
    /// The particulars.
    pub what: String,
}

/// The ways to be wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A panic.
    Panic,
    /// No end within ten seconds.
    Hang,
    /// A result that is infinite or not a number.
    NotFinite,
    /// Shorter steps do not lead to the motion.
    DoesNotConverge,
    /// One step is wrong by the size of the motion, and not marked.
    UnmarkedStep,
    /// The motion ends before the run does, and nothing says so.
    BeyondTheEnd,
    /// The error is above ten times the accuracy that was asked for.
    AboveTolerance,
    /// What is observed, or how a run is divided, changes the result.
    ObservedDiffers,
    /// An equation that the result should solve is not solved.
    Residual,
    /// A factor by which the contact form should be contracted is not the factor.
    NotConformal,
    /// Two routes to the same thing lead to different things.
    RoutesDiffer,
}

pub type Checked = Result<Verdict, Wrong>;

/// A failure, unless a condition holds.
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
        InputError::Hypothesis { .. } => "hypothesis",
        InputError::FirstStep(_) => "first step",
        _ => "another",
    })
}

/// The name of what went wrong along a motion, for the tally.
pub fn ended(cause: &StepError) -> Verdict {
    Verdict::Ended(match cause {
        StepError::NotConverged { .. } => "not converged",
        StepError::Singular { .. } => "singular",
        StepError::SigmaVanished { .. } => "sigma",
        StepError::OutsideDomain { .. } => "outside the domain",
        StepError::ConjugatePoint { .. } => "conjugate point",
        StepError::NonFinite => "not finite",
        StepError::Event { .. } => "event",
        _ => "another",
    })
}

/// The same of the exact side.
pub fn exact<const N: usize>(error: &ExactError<N>) -> Verdict {
    match error {
        ExactError::Input(error) => refused(error),
        ExactError::OutsideDomain { .. } => Verdict::Ended("outside the domain"),
        ExactError::Unfinished { .. } => Verdict::Ended("unfinished"),
        ExactError::NotConverged { .. } => Verdict::Ended("not converged"),
        ExactError::ConjugatePoint { .. } => Verdict::Ended("conjugate point"),
    }
}
