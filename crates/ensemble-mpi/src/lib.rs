//! Ensembles on the ranks of an MPI job.
//!
//! All ranks construct the same [`Ensemble`](https://docs.rs/discrete-herglotz) and call `run`, which needs the feature
//! `mpi`. Rank 0 hands out shards of a few hundred members each; a rank gets another shard when it has sent a result,
//! so that a rank with slow members gets fewer. Rank 0 merges the results in the order of the members, so that its fold
//! is bitwise that of a single process. With a checkpoint, each shard is written when it arrives, in any order. A job
//! that is killed at any point loses only the shards that are being computed, and the next job computes those that are
//! missing.
//!
//! An example is the program `src/bin/ensemble_mpi.rs`. Costs, limits and a plan for 1e4 cores: `docs/scaling.md`.

#[cfg(feature = "mpi")]
mod ranks;

#[cfg(feature = "mpi")]
pub use ranks::{Merged, MpiError, run};
