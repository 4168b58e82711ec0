//! Why an ensemble cannot begin.

use crate::InputError;
use thiserror::Error;

/// Why an ensemble cannot begin.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum EnsembleError {
    /// It has no members.
    #[error("the ensemble has no members; give it at least one")]
    Empty,
    /// It is to run on no thread.
    #[error("the ensemble is to run on 0 threads; give it at least 1, or say nothing for as many as there are processors")]
    Threads,
    /// A member's run would be refused, for what holds for all of them, or where a claim on the Lagrangian is false.
    #[error("member {index}: {cause}")]
    Member {
        /// Which one.
        index: usize,
        /// Why.
        cause: InputError,
    },
}
