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
    #[error(
        "the ensemble is to run on 0 threads; give it at least 1, or say nothing for as many as there are processors"
    )]
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
        "an ensemble under the eyes of observers has no checkpoint; leave it out, or take `rows_every` for the states on the way"
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
        "{} has the shards of another ensemble; go on with the same members, integrator, steps, end and requests, or give another file",
        .path.display()
    )]
    AnotherEnsemble {
        /// The file.
        path: PathBuf,
    },
    /// A shard that was computed elsewhere does not belong to this ensemble.
    #[error(
        "a shard that was computed elsewhere is none of this ensemble; compare the fingerprints of all who compute"
    )]
    ForeignShard,
}

impl EnsembleError {
    pub(crate) fn checkpoint(path: &Path, cause: CheckpointError) -> Self {
        EnsembleError::Checkpoint { path: path.into(), cause }
    }
}
