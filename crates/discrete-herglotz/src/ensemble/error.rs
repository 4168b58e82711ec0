//! Why an ensemble cannot begin, or go on.

use crate::{CheckpointError, InputError};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why an ensemble cannot begin, or go on.
#[derive(Debug, Error)]
pub enum EnsembleError {
    /// It has no members.
    #[error("the ensemble has no members; give it at least one")]
    Empty,
    /// It is to run on no thread.
    #[error(
        "the ensemble is to run on 0 threads; give it at least 1, or say nothing for as many as there are processors"
    )]
    Threads,
    /// A member's run would be refused, for what holds for all of them, or where a claim on the Lagrangian is false.
    #[error("member {index}: {cause}")]
    Member {
        /// Which one.
        index: usize,
        /// Why.
        cause: InputError,
    },
    /// Its members are observed, and what observers see is in no checkpoint.
    #[error(
        "an ensemble under the eyes of observers has no checkpoint; leave it out, or take `rows_every` for the states on the way"
    )]
    Observed,
    /// The file of its shards cannot be read or written.
    #[error("{}: {cause}", .path.display())]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: CheckpointError,
    },
    /// The file has the shards of another ensemble.
    #[error(
        "{} has the shards of another ensemble; go on with the same members, integrator, steps, end and requests, or give another file",
        .path.display()
    )]
    AnotherEnsemble {
        /// The file.
        path: PathBuf,
    },
    /// What came as a shard computed elsewhere is none of this ensemble.
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
