//! Ensembles on the ranks of an MPI job.
//!
//! All ranks construct the same [`Ensemble`](https://docs.rs/discrete-herglotz) and call `run`, which needs the feature
//! `mpi`. Rank 0 hands out shards of a few hundred members each; a rank gets another shard when it has sent a result,
//! so that a rank with slow members gets fewer. Rank 0 merges the results in the order of the members, so that its fold
//! is bitwise that of a single process. With a checkpoint, each shard is written when it arrives, in any order. A job
//! that is killed at any point loses only the shards that are being computed, and the next job computes those that are
//! missing.
//!
#![cfg_attr(
    feature = "mpi",
    doc = r#"
```no_run
use contact_examples::systems::Pendulum;
use contact_geom::VelocityPoint;
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
//! Costs, limits and a plan for 1e4 cores: `docs/scaling.md`.

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
