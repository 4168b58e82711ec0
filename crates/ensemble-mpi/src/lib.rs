//! Ensembles over the ranks of an MPI job.
//!
//! All ranks make the same [`Ensemble`](https://docs.rs/discrete-herglotz) and call `run`, behind the feature `mpi`. Rank 0 hands out numbers of shards, a few hundred members
//! each, as the others ask for them by sending results, so that a rank with slow members gets fewer shards. It merges what comes in the order of the
//! members: the fold on rank 0 sees the same bits as that of a single process. With a checkpoint, each shard is written as it comes, in
//! any order; a job that is killed at any point loses the shards under way, and the next one goes on with those that are missing.
//!
#![cfg_attr(
    feature = "mpi",
    doc = r#"
```no_run
use contact_geom::{VelocityPoint, systems::Pendulum};
use discrete_herglotz::{Ensemble, SplittingScheme, Steps, Until};
use ensemble_mpi::{Options, run};

let universe = mpi::initialize().ok_or("MPI is in use")?;
let pendulum = Pendulum { gamma: -0.01 };
let start = |i: usize| VelocityPoint::new([1e-5 * i as f64], [0.5], 0.0);
let ensemble = Ensemble::new(&pendulum, 0.0, 100_000, start)
    .by(SplittingScheme::BLANES_MOAN_6)
    .steps(Steps::Size(0.25))
    .checkpoint("pendula.shards");
let mut sum = 0.0;
let merged = run(&universe.world(), &ensemble, Until::Time(100.0), Options::default(), |member| {
    sum += member.ending.map_or(0.0, |ending| ending.state.q[0]);
})?;
// On rank 0 only.
if let Some(merged) = merged {
    println!("{} completed, the sum of the angles is {sum}", merged.tally.completed);
}
# Ok::<(), Box<dyn std::error::Error>>(())
```
"#
)]
//!
//! Costs, limits and a plan to 1e4 cores: `docs/scaling.md`.

mod dispatch;
#[cfg(feature = "mpi")]
mod error;
#[cfg(feature = "mpi")]
mod ranks;

pub use dispatch::Dispatch;
#[cfg(feature = "mpi")]
pub use error::MpiError;
#[cfg(feature = "mpi")]
pub use ranks::{Merged, Options, Traffic, run};
