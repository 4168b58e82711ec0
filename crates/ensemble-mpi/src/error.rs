//! Why an ensemble over ranks cannot begin, or go on.

use discrete_herglotz::EnsembleError;
use thiserror::Error;

/// Why an ensemble over ranks cannot begin, or go on.
#[derive(Debug, Error)]
pub enum MpiError {
    /// This rank cannot make or merge the ensemble.
    #[error(transparent)]
    Ensemble(#[from] EnsembleError),
    /// Another rank cannot.
    #[error("rank {rank}: {message}")]
    Refused {
        /// Which one.
        rank: usize,
        /// What it says.
        message: String,
    },
    /// Two ranks have made different ensembles.
    #[error(
        "rank {rank} has another ensemble than rank 0; start all ranks with the same program, members, integrator, steps, end and requests"
    )]
    AnotherEnsemble {
        /// The first rank whose ensemble is not that of rank 0.
        rank: usize,
    },
    /// Nothing was heard of a rank for longer than [`Options::patience`](crate::Options::patience). The ranks cannot come together any more: end the job with
    /// [`abort`](mpi::topology::Communicator::abort).
    #[error(
        "nothing was heard of rank {rank} for {seconds} s, and {open} of its shards are open; run again from the checkpoint, or with more patience than \
         a shard takes"
    )]
    RankLost {
        /// Which one.
        rank: usize,
        /// The shards that it was to compute; they are lost.
        open: usize,
        /// How long it was waited for.
        seconds: f64,
    },
}
