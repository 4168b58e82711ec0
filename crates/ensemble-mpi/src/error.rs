//! Errors of an ensemble on several ranks.

use discrete_herglotz::ensemble::EnsembleError;
use thiserror::Error;

/// The reason why an ensemble on several ranks cannot start or continue.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MpiError {
    /// This rank cannot construct or merge the ensemble.
    #[error(transparent)]
    Ensemble(#[from] EnsembleError),
    /// Another rank cannot construct or merge the ensemble.
    #[error("rank {rank}: {message}")]
    Refused {
        /// The rank.
        rank: usize,
        /// Its error message.
        message: String,
    },
    /// Two ranks have constructed different ensembles.
    #[error(
        "rank {rank} has a different ensemble from rank 0; start all ranks with the same program, members, \
         integrator, steps, end and requests"
    )]
    AnotherEnsemble {
        /// The first rank whose ensemble is not that of rank 0.
        rank: usize,
    },
    /// No result of a rank has arrived for longer than [`Options::patience`](crate::Options::patience). Collective
    /// calls are no longer possible: end the job with [`abort`](mpi::topology::Communicator::abort).
    #[error(
        "rank {rank} has sent no message for {seconds} s, and {open} of its shards are incomplete; run again from \
         the checkpoint, or set a patience that is longer than the time of a shard"
    )]
    RankLost {
        /// The rank.
        rank: usize,
        /// The number of its open shards, which are lost.
        open: usize,
        /// How long rank 0 has waited for it.
        seconds: f64,
    },
}
