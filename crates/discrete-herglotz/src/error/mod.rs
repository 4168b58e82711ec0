//! Errors of the input and of the steps, and the status of a run.

mod constraints;
mod selection;

pub use constraints::ConstraintError;
pub use selection::SelectionFailure;

use contact_geom::GeometryError;
use thiserror::Error;

/// Invalid input, detected before the first step.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum InputError {
    /// The step is 0 or not finite, or negative where the direction is given otherwise, as by the end of a run.
    #[error("the step h = {h} must be a finite nonzero number, and positive if the end of the run gives the direction")]
    Step {
        /// The step that was passed.
        h: f64,
    },
    /// The span of a run is not finite, or 0 where it must not be.
    #[error("the span of time is {span}; it must be finite and nonzero (negative for a run backward in time)")]
    Span {
        /// The span that was passed.
        span: f64,
    },
    /// A requested error is not a positive finite number.
    #[error("the requested relative error is {wanted}; it must be positive and finite")]
    Tolerance {
        /// The requested error.
        wanted: f64,
    },
    /// A scale of a coordinate is not a positive finite number.
    #[error(
        "the scale of coordinate {index} is {scale}; a scale is the size of a coordinate and must be positive and \
         finite"
    )]
    Scale {
        /// The coordinate, counted from 0.
        index: usize,
        /// The scale that was passed.
        scale: f64,
    },
    /// A requested accuracy is not reached.
    #[error("the requested relative error {wanted:e} is not {}: {cause}", how_near(*wanted, *reached))]
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
    #[error("{what} is {found:e}; it can be at most {most:e}: {remedy}")]
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
    #[error("the run has no steps; set them with `steps`, or request an `accuracy`")]
    NoSteps,
    /// A run with given steps has no integrator.
    #[error(
        "the run has no integrator; set it with `by`, or request an `accuracy` without steps, for which an \
         integrator is selected"
    )]
    NoIntegrator,
    /// The trial runs of a plan were interrupted.
    #[error("the trial runs were interrupted before they determined a step; run again, or give a step")]
    Interrupted,
    /// The resumed run differs from the interrupted one.
    #[error(
        "the run differs from the interrupted one; resume it with the same problem, integrator, steps, end and requests"
    )]
    AnotherRun,
    /// A checkpoint was requested for a run whose stepper does not implement saving.
    #[error(
        "the stepper of the integrator cannot be saved; remove the checkpoint, or implement `save` and \
         `restore` of `RunSupport`"
    )]
    Unsaved,
    /// Times of output are not in order, not finite, or outside of the span of the run.
    #[error(
        "the time t = {t} of row {index} is out of order, not finite or outside of the span of the run; give finite \
         times within the span, in the direction of the run"
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
    /// A velocity has no momentum under a contact Hamiltonian.
    #[error(
        "the velocity at the start has no momentum: H_pp is singular, or no momentum was found with H_p = v; start from \
         a momentum instead, with which every contact Hamiltonian can be run"
    )]
    NoMomentum,
    /// The number of stages of a collocation method is out of range.
    #[error("the number of stages is {found}; contact Gauss collocation has from 1 to 16")]
    Stages {
        /// The number of stages that was passed.
        found: usize,
    },
    /// The rate of a time transformation is zero, negative or not defined at the start.
    #[error("the rate dt/dtau of the time transformation is {rate} at the start; it must be positive and finite")]
    TimeTransformation {
        /// The rate at the start.
        rate: f64,
    },
    /// The configuration space has dimension 0.
    #[error("the configuration space has dimension 0; a Lagrangian needs at least one coordinate")]
    Dimension,
    /// A count of steps, rows or points is too small.
    #[error("{what} is {found}; it must be at least {least}")]
    Count {
        /// What is counted.
        what: &'static str,
        /// The smallest count that is accepted.
        least: usize,
        /// The count that was passed.
        found: usize,
    },
    /// A path has another number of steps than the problem.
    #[error("the path has {found} steps, but the problem has {expected}; pass {expected} + 1 points")]
    PathLength {
        /// The number of steps of the problem.
        expected: usize,
        /// The number of steps of the path.
        found: usize,
    },
    /// An error of the geometry: an invalid coordinate, slice or matrix.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// Invalid constraints, or a start that they do not admit.
    #[error(transparent)]
    Constraint(#[from] ConstraintError),
    /// The conformal factor is not positive at the start.
    #[error(
        "sigma_d = {sigma} at the start, but it must be positive (h L_z > -1 for rules explicit in z); take a \
         smaller step"
    )]
    Sigma {
        /// The value of sigma_d.
        sigma: f64,
    },
    /// The two initial points coincide, and the discrete Lagrangian is not regular there.
    #[error(
        "the initial points coincide (q0 = q1), and the discrete Lagrangian is not regular there; pass two different \
         points"
    )]
    EqualPoints,
    /// The method requires a form of the Lagrangian that this one does not claim to have.
    #[error(
        "the method requires the property `{claim}`, which the Lagrangian does not claim; claim it in `structure` if \
         it holds, or choose another method"
    )]
    Unclaimed {
        /// The name of the claim, a field of [`Structure`](contact_geom::Structure).
        claim: &'static str,
    },
    /// A claim on the form of the Lagrangian is false.
    #[error(
        "the Lagrangian claims the property `{claim}`, which does not hold: a derivative that must vanish has the \
         relative size {size:e}; correct its `structure`"
    )]
    FalseClaim {
        /// The name of the claim, a field of [`Structure`](contact_geom::Structure).
        claim: &'static str,
        /// The size of what the claim says is zero; see [`Defect`](contact_geom::Defect).
        size: f64,
    },
    /// A Lagrangian has switching functions that its `HINTS` do not state.
    #[error(
        "the Lagrangian has `switching_functions` that its hints do not declare; add `const HINTS: Hints = Hints {{ \
         switching_functions: true, ..Hints::NONE }}`"
    )]
    SwitchingUnstated,
    /// The Lagrangian does not satisfy a hypothesis of the method.
    #[error("the method requires {hypothesis}; choose another method or another Lagrangian")]
    Hypothesis {
        /// The hypothesis.
        hypothesis: &'static str,
    },
    /// A problem under constraints has switching functions or breaks.
    #[error(
        "the Lagrangian or the force has kinks or jumps, and steps under constraints do not end on them; smooth it, or choose \
         coordinates in which the constraints are solved"
    )]
    KinksUnderConstraints,
    /// The pieces of a splitting do not sum to the contact Hamiltonian.
    #[error(
        "the pieces of the splitting do not sum to the contact Hamiltonian: near the start they differ by {size:e}, \
         relative to the size of the terms; add the missing piece, or correct one"
    )]
    PieceSum {
        /// The difference, relative to the sum of the magnitudes of H and of the pieces.
        size: f64,
    },
    /// The flow of a piece of a splitting is not that of its contact Hamiltonian.
    #[error(
        "the flow of piece {index} of the splitting is not that of its contact Hamiltonian: near the start they differ by \
         {size:e}; correct the flow, or choose a kind of piece that has this form"
    )]
    PieceFlow {
        /// The index of the piece, from 0.
        index: usize,
        /// The difference, relative to the size of the state.
        size: f64,
    },
    /// The method needs a time transformation, which the Lagrangian does not state.
    #[error(
        "the method requires a Lagrangian that declares a time transformation (`Hints::time_transformation`, `dt_dtau`); choose another integrator or another Lagrangian"
    )]
    NoTimeTransformation,
    /// The problem has an applied force that the method does not take.
    #[error(
        "the problem has a force that {method} does not take; choose contact Gauss collocation (`GaussCollocation`), \
         which takes every force, or write the force into the Lagrangian"
    )]
    Forced {
        /// The method.
        method: &'static str,
    },
    /// The first step fails.
    #[error("the first step fails: {0}")]
    FirstStep(StepError),
}

/// The part of the message for an accuracy that was not reached, depending on the difference between the trial runs.
fn how_near(wanted: f64, reached: f64) -> String {
    if !reached.is_finite() {
        "reached, since no two trial runs could be compared".to_owned()
    } else if reached <= wanted {
        format!("guaranteed, although trial runs agree to {reached:.1e}")
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
    #[error(
        "the iteration did not converge: it left a residual of {residual:e} after {iterations} iterations; take a \
         smaller step"
    )]
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
    #[error("sigma_d = {sigma} is not positive, so that the step is not conformally contact; take a smaller step")]
    SigmaVanished {
        /// The value of sigma_d.
        sigma: f64,
    },
    /// The integrating factor of a stage of a collocation step is not positive, so that the step is not conformally
    /// contact.
    #[error(
        "the integrating factor of a stage is {rho}, but it must be positive: the step is too long for the rate L_z \
         of the conformal factor; take a smaller step or more stages"
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
    #[error(
        "the two points of the step are conjugate (smallest singular value {smallest:e}); take a step of another size"
    )]
    ConjugatePoint {
        /// The smallest singular value of the derivative of the end position in the initial velocity, a time.
        smallest: f64,
    },
    /// The subdivision of a step fails: the shortest part does not resolve the motion, or there are too many parts.
    #[error(
        "the step cannot be divided into parts that resolve the motion near t = {t}: the defect of the interpolated \
         motion there is due to round-off, or to a kink for which the Lagrangian has no switching function; allow a \
         larger defect, take shorter steps, or end the run before this time"
    )]
    Undivided {
        /// The time.
        t: f64,
    },
    /// The Lagrangian switches too often within a step.
    #[error(
        "the Lagrangian switches too often near t = {t}: the motion slides along the surface of a kink or a jump, or \
         crosses it at ever shorter intervals; smooth the kink, give dry friction that sticks as `friction`, or end the \
         run before this time"
    )]
    Switching {
        /// The time that is reached.
        t: f64,
    },
    /// The state after a reset is not finite, or L is not defined or not regular there.
    #[error(
        "the reset at t = {t} gives a state that is not finite, or at which the Lagrangian is not defined; change what \
         the reset assigns"
    )]
    ResetUndefined {
        /// The time of the reset.
        t: f64,
    },
    /// The state after a reset is beyond the surface of the reset.
    #[error(
        "the reset at t = {t} leaves the state on the other side of its own surface; assign a state on the surface or \
         on the side from which the motion came"
    )]
    ResetBeyond {
        /// The time of the reset.
        t: f64,
    },
    /// Resets accumulate.
    #[error(
        "resets accumulate at t = {t}: infinitely many of them occur before this time; end the run before it, or say \
         from which state the motion continues: a formula stays on the surface where `rest` assigns the velocity of the \
         surface to its one coordinate"
    )]
    Accumulation {
        /// The limit of their times.
        t: f64,
    },
    /// The motion rests on the surface of a reset, and is pressed onto it.
    #[error(
        "the motion rests at t = {t} on the surface of a reset, and is pressed onto it; a formula stays \
         there where `rest` of the reset assigns the velocity of the surface to its one coordinate; otherwise end the run \
         before, let the reset assign a state that leaves the surface or a coordinate that switches the force off, or \
         replace the surface by a stiff force"
    )]
    Contact {
        /// The time at which the contact begins.
        t: f64,
    },
    /// The Lagrangian jumps across a surface that depends on the velocity or on the action, or that the motion only
    /// touches; there the corner conditions do not determine how the motion continues.
    #[error(
        "the Lagrangian jumps at t = {t} across a surface that depends on the velocity or on z, or that the motion \
         only touches, so that the variational principle does not determine how the motion continues; smooth the \
         jump, or end the run before this time"
    )]
    JumpAlong {
        /// The time of the jump.
        t: f64,
    },
    /// A coordinate or a derivative is infinite or NaN.
    #[error("a value is not finite: the motion leaves the domain of the Lagrangian, or grows without bound")]
    NonFinite,
    /// The function of an event or of a reset is not finite.
    #[error("the function of an event is not finite at t = {t}; use a function that is defined along the motion")]
    Event {
        /// The time.
        t: f64,
    },
    /// The sign changes of the function of an event cannot be told apart: it varies too fast within a step.
    #[error(
        "the function of an event varies so fast after t = {t} that its sign changes within the step cannot be told \
         apart; take shorter steps, or use a smoother function"
    )]
    EventUnresolved {
        /// The time up to which all sign changes are found.
        t: f64,
    },
    /// A formula branches on a value that differs between SIMD lanes.
    #[error(
        "the Lagrangian or the time transformation branches on a value (by `re`, `extent` or `==`) that differs \
         between SIMD lanes; use `if_less`, `max`, `min`, `abs` or `signum` instead"
    )]
    Branched,
}

impl From<StepError> for GeometryError {
    fn from(_: StepError) -> Self {
        GeometryError::Undefined { what: "the discrete Lagrangian" }
    }
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
            (said(1e-16, defect), "1e-9 is not guaranteed, although trial runs agree to 1.0e-16: between the nodes"),
            (said(1e-16, defect), "has a relative defect of 3.0e-4, which"),
            (
                said(1e-16, SelectionFailure::FeatureAtNodes { distance: 2e-3 }),
                "with one more step ends 2.0e-3 away from the others: a kink",
            ),
            (
                said(1e-7, SelectionFailure::Budget),
                "1e-9 is not reached (trial runs agree to 1.0e-7): the budget of the trial runs",
            ),
            (
                said(f64::INFINITY, SelectionFailure::Budget),
                "1e-9 is not reached, since no two trial runs could be compared: ",
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
