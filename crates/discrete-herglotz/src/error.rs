//! Errors of the input and of the steps, and the status of a run.

use contact_geom::GeometryError;
use thiserror::Error;

/// Invalid input, detected before the first step.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum InputError {
    /// The step is 0 or not finite, or negative where the direction is given otherwise, as by the end of a run.
    #[error(
        "the step h = {h} must be a finite number and not 0; and positive where the end of the run tells its direction"
    )]
    Step {
        /// The step that was passed.
        h: f64,
    },
    /// The span of a run is not finite, or 0 where it must not be.
    #[error("the span of time is {span}; it must be finite and not 0 (negative to go back)")]
    Span {
        /// The span that was passed.
        span: f64,
    },
    /// A requested error is not a positive finite number.
    #[error("the wanted relative error is {wanted}; it must be positive and finite")]
    Tolerance {
        /// The requested error.
        wanted: f64,
    },
    /// A scale of a coordinate is not a positive finite number.
    #[error("the scale of coordinate {index} is {scale}; scales are sizes of the coordinates, positive and finite")]
    Scale {
        /// The coordinate, counted from 0.
        index: usize,
        /// The scale that was passed.
        scale: f64,
    },
    /// A requested accuracy is not reached.
    #[error("the wanted relative error {wanted:e} is not {}: {cause}", how_near(*wanted, *reached))]
    Accuracy {
        /// The requested error.
        wanted: f64,
        /// The smallest difference between trial runs; infinite where none were compared. It is below the requested
        /// error where the accuracy fails for another reason than this difference.
        reached: f64,
        /// The reason.
        cause: SelectionFailure,
    },
    /// A number is too large to be counted or stored, or its items are too close to be distinguished.
    #[error("{what} = {found:e}; at most {most:e} are possible: {remedy}")]
    TooMany {
        /// What is counted.
        what: &'static str,
        /// The requested number.
        found: f64,
        /// The largest possible number.
        most: f64,
        /// The remedy.
        remedy: &'static str,
    },
    /// A run has neither steps nor an accuracy from which they are chosen.
    #[error("the run has no steps; give them by `steps`, or ask for an `accuracy`")]
    NoSteps,
    /// A run with given steps has no integrator.
    #[error("the run has no integrator; name one by `by`, or ask for an `accuracy` for which one is chosen")]
    NoIntegrator,
    /// The trial runs of a plan were interrupted.
    #[error("the trial runs were interrupted before a step was found; run it again, or give a step")]
    Interrupted,
    /// The resumed run differs from the interrupted one.
    #[error(
        "the run is not the one that was interrupted; resume it with the same problem, integrator, steps, end and requests"
    )]
    AnotherRun,
    /// A checkpoint was requested for a run whose stepper does not implement saving.
    #[error(
        "the integrator's stepper cannot be saved; leave the checkpoint out, or give it `Stepper::save` and `restore`"
    )]
    Unsaved,
    /// Times of output are not in order, not finite, or outside of the span of the run.
    #[error(
        "the time t = {t} of row {index} is out of order, not finite or outside of the run's span; give times in the order of the run"
    )]
    Times {
        /// The first row with such a time.
        index: usize,
        /// The time.
        t: f64,
    },
    /// The Lagrangian has no finite value or derivative at the start.
    #[error("the Lagrangian or one of its derivatives is not finite at the start; choose a start inside its domain")]
    Undefined,
    /// The number of stages of a collocation method is out of range.
    #[error("{found} stages; contact Gauss collocation has from 1 to 16")]
    Stages {
        /// The number of stages that was passed.
        found: usize,
    },
    /// The rate of a time transformation is zero, negative or not defined at the start.
    #[error("the rate dt/dtau is {rate} at the start; it must be positive and finite")]
    TimeTransformation {
        /// The rate at the start.
        rate: f64,
    },
    /// The configuration space has dimension 0.
    #[error("the configuration space has dimension 0; a Lagrangian needs at least one coordinate")]
    Dimension,
    /// A count of steps, rows or points is too small.
    #[error("{what} = {found}; at least {least} is needed")]
    Count {
        /// What is counted.
        what: &'static str,
        /// The smallest count that is accepted.
        least: usize,
        /// The count that was passed.
        found: usize,
    },
    /// A path has another number of steps than the problem.
    #[error("the path has {found} steps where the problem has {expected}; pass {expected} + 1 points")]
    PathLength {
        /// The number of steps of the problem.
        expected: usize,
        /// The number of steps of the path.
        found: usize,
    },
    /// An error of the geometry: an invalid coordinate, slice or matrix.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// The conformal factor is not positive at the start.
    #[error(
        "sigma_d = {sigma} at the start, where it must be positive (h L_z > -1 for rules explicit in z); \
         take a smaller step"
    )]
    Sigma {
        /// The value of sigma_d.
        sigma: f64,
    },
    /// The two initial points coincide, and the discrete Lagrangian is not regular there.
    #[error(
        "q0 = q1 at the start, and the discrete Lagrangian is not regular on the diagonal; pass two different points"
    )]
    EqualPoints,
    /// The method requires a form of the Lagrangian that this one does not claim to have.
    #[error("the Lagrangian does not claim to be {claim}; claim it in `structure` if it is, or take another method")]
    Unclaimed {
        /// The name of the claim, a field of [`Structure`](contact_geom::Structure).
        claim: &'static str,
    },
    /// A claim on the form of the Lagrangian is false.
    #[error(
        "the Lagrangian claims to be {claim}, and is not: a derivative that should vanish has the relative size {size:e}"
    )]
    FalseClaim {
        /// The name of the claim, a field of [`Structure`](contact_geom::Structure).
        claim: &'static str,
        /// The size of what the claim says is zero; see [`Defect`](contact_geom::Defect).
        size: f64,
    },
    /// A Lagrangian has switching functions that its `HINTS` do not state.
    #[error(
        "the Lagrangian has `switching_functions`; state them by `const HINTS: Hints = Hints {{ switching_functions: true, ..Hints::NONE }}`"
    )]
    SwitchingUnstated,
    /// The Lagrangian does not satisfy a hypothesis of the method.
    #[error("the method needs {hypothesis}; take another method or another Lagrangian")]
    Hypothesis {
        /// The hypothesis.
        hypothesis: &'static str,
    },
    /// The method needs a time transformation, which the Lagrangian does not state.
    #[error(
        "the method needs a Lagrangian that states a time transformation (`Hints::time_transformation`, `dt_dtau`); take another method or another Lagrangian"
    )]
    NoTimeTransformation,
    /// The first step fails.
    #[error("no first step from this start: {0}")]
    FirstStep(StepError),
}

/// The part of the message for an accuracy that was not reached, depending on the difference between the trial runs.
fn how_near(wanted: f64, reached: f64) -> String {
    if !reached.is_finite() {
        "reached, and no two trial runs could be compared".to_owned()
    } else if reached <= wanted {
        format!("certain, though trial runs agree to {reached:.1e}")
    } else {
        format!("reached (trial runs agree to {reached:.1e})")
    }
}

impl InputError {
    /// The input error for a first step that fails.
    pub(crate) fn first_step(cause: StepError) -> Self {
        match cause {
            StepError::SigmaVanished { sigma } => InputError::Sigma { sigma },
            cause => InputError::FirstStep(cause),
        }
    }
}

/// The cause of a step that failed with valid input.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum StepError {
    /// Newton's method did not reach round-off.
    #[error("Newton's method left a residual of {residual:e} after {iterations} iterations; take a smaller step")]
    NotConverged {
        /// The largest component of the last residual, a momentum.
        residual: f64,
        /// The number of iterations.
        iterations: u32,
    },
    /// The derivative of F-L_d (or F+L_d) is singular.
    #[error("the discrete Lagrangian is not regular here (pivot {pivot:e}); take a smaller step")]
    Singular {
        /// The vanishing pivot.
        pivot: f64,
    },
    /// sigma_d = 1 + Dz L_d is not positive.
    #[error("sigma_d = {sigma} is not positive, so the step is not conformally contact; take a smaller step")]
    SigmaVanished {
        /// The value of sigma_d.
        sigma: f64,
    },
    /// The integrating factor of a stage of a collocation step is not positive, so that the step is not conformally
    /// contact.
    #[error(
        "the integrating factor of a stage is {rho}, where it must be positive: the step is too long for the rate L_z of the \
         conformal factor; take a smaller step or more stages"
    )]
    StageFactor {
        /// The smallest factor of a stage, 1 at the start of the step.
        rho: f64,
    },
    /// The exact motion is not defined up to the end of the step.
    #[error("the motion is defined only until t = {t}; take a smaller step")]
    OutsideDomain {
        /// The time until which it is defined.
        t: f64,
    },
    /// The two points of a step are conjugate along the exact motion, so that they do not determine it.
    #[error("the points of the step are conjugate (singular value {smallest:e}); take another step")]
    ConjugatePoint {
        /// The smallest singular value of the derivative of the end position in the initial velocity, a time.
        smallest: f64,
    },
    /// The subdivision of a step fails: the shortest part does not resolve the motion, or there are too many parts.
    #[error(
        "the step cannot be divided into parts that resolve the motion near t = {t}: the defect of its curve there is that of \
         round-off, or of a kink that the Lagrangian does not tell; allow a larger one, take shorter steps, or end the run before"
    )]
    Undivided {
        /// The time.
        t: f64,
    },
    /// The Lagrangian switches too often within a step.
    #[error(
        "the Lagrangian switches at its kinks or jumps without end near t = {t}: the motion is held on a surface from both sides, or \
         crosses it ever faster; smooth the kink, or end the run before"
    )]
    Switching {
        /// The time that is reached.
        t: f64,
    },
    /// The Lagrangian jumps across a surface that depends on the velocity or on the action, or that the motion only
    /// touches; there the corner conditions do not determine how the motion continues.
    #[error(
        "the Lagrangian jumps at t = {t} across a surface that depends on the velocity or on z, or that the motion only touches, where \
         the principle does not say how the motion goes on; smooth the jump, or end the run before"
    )]
    JumpAlong {
        /// The time of the jump.
        t: f64,
    },
    /// A coordinate or a derivative is infinite or NaN.
    #[error("a value is not finite: the motion leaves the domain of the Lagrangian, or grows without bound")]
    NonFinite,
    /// The function of an event is not finite.
    #[error("the function of an event is not finite at t = {t}; give one that is defined along the motion")]
    Event {
        /// The time.
        t: f64,
    },
    /// A formula branches on a value that differs between SIMD lanes.
    #[error(
        "the Lagrangian or the time transformation asks for one value (`re`, `extent`, `==`) of lanes that differ; \
         choose by `if_less`, `max`, `min`, `abs` or `signum`"
    )]
    Branched,
}

impl From<StepError> for GeometryError {
    fn from(_: StepError) -> Self {
        GeometryError::Undefined { what: "the discrete Lagrangian" }
    }
}

/// The reason why a requested accuracy is not reached.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SelectionFailure {
    /// Round-off: shorter steps do not improve the result.
    #[error("round-off of the motion is larger; ask for less")]
    RoundOff,
    /// The motion is chaotic: runs with different steps separate like those from different initial states.
    #[error(
        "the motion is chaotic, and round-off grows beyond the wanted error after t = {t}; end the run there, or ask for less"
    )]
    Chaos {
        /// The last time, in tenths of the span, at which runs agree.
        t: f64,
    },
    /// Runs converge more slowly than for a smooth motion.
    #[error("{}", how_runs_converge(*order))]
    Order {
        /// The observed order of the last runs.
        order: f64,
    },
    /// Runs agree where they are compared, but between the nodes of their steps the motion does not satisfy the
    /// equations.
    #[error(
        "between the nodes of their steps the motion misses its equations by {defect:.1e} of its size, which shorter steps better only \
         with order {order:.1}: a kink, a jump or something narrow lies there; ask for less, or smooth the Lagrangian"
    )]
    DefectBetweenNodes {
        /// The largest defect of the finer run, relative to the largest momentum.
        defect: f64,
        /// The order with which it decreases.
        order: f64,
    },
    /// Runs whose nodes coincide agree with each other, but not with a run with other nodes.
    #[error(
        "a trial run with one step more {}: a kink, a jump or a pulse lies at the ends of their steps; end the span beside it, or smooth the \
         Lagrangian",
        how_far(*distance)
    )]
    FeatureAtNodes {
        /// The distance between the final states; infinite where the run with one more step does not resolve the
        /// motion.
        distance: f64,
    },
    /// A step fails however short it is.
    #[error(
        "the motion cannot be followed beyond t = {t}, however short the steps: end the span before it (the last attempt: {cause})"
    )]
    StepFailed {
        /// The time that is reached.
        t: f64,
        /// The cause of the last failure.
        cause: StepError,
    },
    /// Near a certain time the motion is too fast, or the force too narrow, for the steps that can be tried.
    #[error(
        "near t = {t} the motion is not resolved by any step that was tried: it is too fast or too narrow there; take a shorter span"
    )]
    Unresolved {
        /// The time.
        t: f64,
    },
    /// The trial runs would exceed their budget.
    #[error(
        "the budget of the trial runs is used up, since the steps that the motion needs are too many to be tried; take a method of higher \
         order, a shorter span, or give a step"
    )]
    Budget,
}

/// The part of the message for a run whose final state has this distance from those of others.
fn how_far(distance: f64) -> String {
    if distance.is_finite() {
        format!("ends {distance:.1e} away from them")
    } else {
        "does not resolve the motion".to_owned()
    }
}

/// The part of the message for runs that converge with a low order, or not at all.
fn how_runs_converge(order: f64) -> String {
    // An order below this is not distinguishable from noise.
    const NONE: f64 = 0.25;
    if order >= NONE {
        format!(
            "runs converge only with order {order:.1}: the Lagrangian is not smooth along the motion, or the method's order is low; ask for \
             less, or take a method of higher order if the Lagrangian is smooth"
        )
    } else {
        "runs do not converge as their steps get shorter: the Lagrangian is not smooth along the motion, or the motion amplifies its \
         round-off; ask for less, or end the run before"
            .to_owned()
    }
}

/// A step whose defect is far larger than that of any step that resolves the motion. It may have crossed a pole, a wall
/// or a centre of force without evaluating the force there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnresolvedStep {
    /// The first such step, counted from 0.
    pub step: usize,
    /// The defect, in units of the largest defect of a step that resolves the motion; larger than one.
    pub defect: f64,
}

impl std::fmt::Display for UnresolvedStep {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let UnresolvedStep { step, defect } = self;
        write!(
            f,
            "step {step} does not resolve the motion (defect {defect:.1e}); what follows may be wrong: take a smaller step"
        )
    }
}

/// How a run ended. The output recorded before the end is kept.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Status {
    /// All steps were taken.
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
                "unreliable: after step {step} the Lagrangian is not {claim}, as it claims (relative size {size:e}); correct \
                 its structure and run again"
            ),
            Status::Failed { step, t, cause } => write!(f, "failed in step {step} at t = {t}: {cause}"),
        }
    }
}

/// The earlier of two unresolved steps.
pub(crate) fn first(a: Option<UnresolvedStep>, b: Option<UnresolvedStep>) -> Option<UnresolvedStep> {
    a.into_iter().chain(b).min_by_key(|s| s.step)
}

/// The step error for a stepper that cannot be constructed.
pub(crate) fn step_error(error: InputError) -> StepError {
    match error {
        InputError::FirstStep(cause) => cause,
        InputError::Sigma { sigma } => StepError::SigmaVanished { sigma },
        _ => StepError::NonFinite,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The messages for an accuracy that is not reached. If the difference between trial runs is below the requested
    /// error, the message gives the other reason. A difference that was not computed is not mentioned, nor is the order
    /// of runs that do not converge.
    #[test]
    fn an_accuracy_says_what_was_not_reached() {
        let said =
            |reached: f64, cause: SelectionFailure| InputError::Accuracy { wanted: 1e-9, reached, cause }.to_string();
        let defect = SelectionFailure::DefectBetweenNodes { defect: 3e-4, order: 0.5 };
        let table = [
            (said(1e-16, defect), "1e-9 is not certain, though trial runs agree to 1.0e-16: between the nodes"),
            (said(1e-16, defect), "misses its equations by 3.0e-4 of its size"),
            (
                said(1e-16, SelectionFailure::FeatureAtNodes { distance: 2e-3 }),
                "with one step more ends 2.0e-3 away from them: a kink",
            ),
            (
                said(1e-7, SelectionFailure::Budget),
                "1e-9 is not reached (trial runs agree to 1.0e-7): the budget of the trial runs",
            ),
            (
                said(f64::INFINITY, SelectionFailure::Budget),
                "1e-9 is not reached, and no two trial runs could be compared: ",
            ),
            (said(1e-7, SelectionFailure::Order { order: 1.9 }), "runs converge only with order 1.9: "),
            (said(1e-7, SelectionFailure::Order { order: 0.0 }), "runs do not converge as their steps get shorter: "),
            (said(1e-7, SelectionFailure::Order { order: -0.7 }), "runs do not converge as their steps get shorter: "),
            (
                said(1e-7, SelectionFailure::Order { order: f64::NAN }),
                "runs do not converge as their steps get shorter: ",
            ),
        ];
        for (sentence, words) in table {
            assert!(sentence.contains(words), "no {words:?} in {sentence:?}");
            let foreign = ["inf", "NaN", "best estimate", "transformation"];
            assert!(foreign.iter().all(|word| !sentence.contains(word)), "{sentence:?}");
        }
    }
}
