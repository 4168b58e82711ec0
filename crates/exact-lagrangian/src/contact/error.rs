//! Errors of exact motions of contact Hamiltonians.

use contact_geom::PhasePoint;
use thiserror::Error;

/// The reason why a motion of a contact Hamiltonian, or the motion with a given end, could not be computed. Errors
/// along a motion carry the state that was reached.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ContactFlowError<const N: usize> {
    /// An argument is NaN or infinite; nothing was computed.
    #[error("the {what} is not finite; pass finite numbers")]
    NonFinite {
        /// What is not finite.
        what: &'static str,
    },
    /// H or its gradient is not finite at the start.
    #[error("H or its gradient is not finite at the start, t = {t}; take a start in the domain of H")]
    Undefined {
        /// The initial time.
        t: f64,
    },
    /// The motion is not defined, or not resolved, up to the end.
    #[error("the motion is resolved only until t = {t}; take a shorter time or another start")]
    OutsideDomain {
        /// The time that was reached.
        t: f64,
        /// The state at that time.
        reached: PhasePoint<N>,
    },
    /// The motion needs more panels than the limit.
    #[error("the largest number of panels was reached at t = {t}; continue from there, or take a shorter time")]
    Unfinished {
        /// The time that was reached.
        t: f64,
        /// The state at that time.
        reached: PhasePoint<N>,
    },
    /// No motion with the given end was found.
    #[error(
        "no motion with the given end was found (residual {residual:e}); pass a guess of it, or take a shorter time"
    )]
    NotConverged {
        /// The start of the last motion tried.
        last: PhasePoint<N>,
        /// The largest component of the distance between its end and the given one.
        residual: f64,
    },
    /// The given end does not determine the motion: its derivative in the unknown of the start is singular to
    /// round-off.
    #[error(
        "the given end does not determine the motion: its derivative in the unknown of the start is singular (smallest \
         singular value {smallest:e} of its size); use a generating function of another type, or another time"
    )]
    Conjugate {
        /// The start of the last motion tried.
        last: PhasePoint<N>,
        /// The smallest singular value of the derivative, relative to the derivative of the whole end.
        smallest: f64,
    },
}
