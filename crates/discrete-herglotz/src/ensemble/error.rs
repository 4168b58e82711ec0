//! The errors of an ensemble.

use crate::{CheckpointError, InputError};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The reason why an ensemble cannot start or continue.
#[derive(Debug, Error)]
pub enum EnsembleError {
    /// The ensemble has no members.
    #[error("the ensemble has no members; give it at least one")]
    Empty,
    /// The number of threads is 0.
    #[error("the number of threads is 0; it must be at least 1, and defaults to the number of processors")]
    Threads,
    /// The run of a member is refused, for a reason that holds for all members, or because a claim about the Lagrangian
    /// is false.
    #[error("member {index}: {cause}")]
    Member {
        /// The index of the member.
        index: usize,
        /// The cause.
        cause: InputError,
    },
    /// The members have observers, whose results are not part of a checkpoint.
    #[error(
        "an ensemble with observers cannot be saved to a checkpoint; remove the checkpoint, or record states with \
         `rows_every` instead of observers"
    )]
    Observed,
    /// The checkpoint file cannot be read or written.
    #[error("{}: {cause}", .path.display())]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// The cause.
        cause: CheckpointError,
    },
    /// The file contains the shards of another ensemble.
    #[error(
        "{} contains the shards of another ensemble; use the same members, integrator, steps, end and requests, or \
         another file",
        .path.display()
    )]
    AnotherEnsemble {
        /// The file.
        path: PathBuf,
    },
    /// A shard that was computed elsewhere does not belong to this ensemble.
    #[error(
        "a shard that was computed elsewhere does not belong to this ensemble; compare the fingerprints of all \
         processes"
    )]
    ForeignShard,
}

impl EnsembleError {
    pub(crate) fn checkpoint(path: &Path, cause: CheckpointError) -> Self {
        EnsembleError::Checkpoint { path: path.into(), cause }
    }
}
