//! The reasons why a requested accuracy is not reached.

use crate::StepError;
use thiserror::Error;

/// The reason why a requested accuracy is not reached.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SelectionFailure {
    /// Round-off: shorter steps do not improve the result.
    #[error("the round-off of the motion is larger; request a larger error")]
    RoundOff,
    /// The motion is chaotic: runs with different steps separate like those from different initial states.
    #[error(
        "the motion is chaotic, and its round-off exceeds the requested error after t = {t}; end the run there, or \
         request a larger error"
    )]
    Chaos {
        /// The last time, in tenths of the span, at which runs agree.
        t: f64,
    },
    /// The motion is so sensitive to its start that the last digit of the start determines more of it than the requested
    /// error allows. Runs with different steps may agree with each other nevertheless.
    #[error(
        "the motion is ill-conditioned: an error in the last digit of the start {}, and exceeds the requested error \
         after t = {t}; end the run there, or request a larger error",
        what_becomes_of_it(*distance)
    )]
    IllConditioned {
        /// The largest distance, in the units of the requested error, from a motion whose start differs in the last
        /// digits; infinite where its run fails with the same steps.
        distance: f64,
        /// The last time, in tenths of the span, at which this distance is below the requested error.
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
        "between the nodes of the steps the equation of motion has a relative defect of {defect:.1e}, which \
         decreases only with order {order:.1} for shorter steps, because of a kink, a jump or a narrow pulse of the \
         Lagrangian; request a larger error, or smooth the Lagrangian"
    )]
    DefectBetweenNodes {
        /// The largest defect of the finer run, relative to the largest momentum.
        defect: f64,
        /// The order with which it decreases.
        order: f64,
    },
    /// Runs whose nodes coincide agree with each other, but not with a run with other nodes.
    #[error(
        "a trial run with one more step {}: a kink, a jump or a pulse of the Lagrangian coincides with the ends of \
         the steps of the other runs; end the span before it, or smooth the Lagrangian",
        how_far(*distance)
    )]
    FeatureAtNodes {
        /// The distance between the final states; infinite where the run with one more step does not resolve the
        /// motion.
        distance: f64,
    },
    /// A step fails however short it is.
    #[error(
        "the motion cannot be computed beyond t = {t} even with very short steps; end the span before this time \
         (last failure: {cause})"
    )]
    StepFailed {
        /// The time that is reached.
        t: f64,
        /// The cause of the last failure.
        cause: StepError,
    },
    /// Near a certain time the motion is too fast, or the force too narrow, for the steps that can be tried.
    #[error(
        "near t = {t} none of the tried steps resolves the motion, which is too fast there or has too narrow a \
         force; take a shorter span"
    )]
    Unresolved {
        /// The time.
        t: f64,
    },
    /// The trial runs would exceed their budget.
    #[error(
        "the budget of the trial runs is used up, since the motion needs too many steps; choose a method of higher \
         order or a shorter span, or give a step"
    )]
    Budget,
}

/// The part of the message for a run whose final state has this distance from those of others.
fn how_far(distance: f64) -> String {
    if distance.is_finite() {
        format!("ends {distance:.1e} away from the others")
    } else {
        "does not resolve the motion".to_owned()
    }
}

/// The part of the message for what an error in the last digit of the start becomes.
fn what_becomes_of_it(distance: f64) -> String {
    if distance.is_finite() { format!("becomes {distance:.1e}") } else { "makes a step fail".to_owned() }
}

/// The part of the message for runs that converge with a low order, or not at all.
fn how_runs_converge(order: f64) -> String {
    // An order below this is not distinguishable from noise.
    const NONE: f64 = 0.25;
    if order >= NONE {
        format!(
            "the trial runs converge only with order {order:.1}: the Lagrangian is not smooth along the motion, or \
             the method has a low order; request a larger error, or choose a method of higher order if the Lagrangian \
             is smooth"
        )
    } else {
        "the trial runs do not converge as their steps get shorter: the Lagrangian is not smooth along the motion, \
         or the motion amplifies its round-off; request a larger error, or end the run earlier"
            .to_owned()
    }
}
