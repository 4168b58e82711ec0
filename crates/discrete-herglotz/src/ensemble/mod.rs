//! Ensembles: many motions at once, each in a SIMD lane.

mod accuracy;
pub(crate) mod builder;
mod checkpoint;
mod convergence;
mod error;
mod gauss;
mod lane;
mod member;
pub(crate) mod members;
mod observed;
mod settings;
mod sharded;
pub(crate) mod shards;
pub(crate) mod single;
mod splitting;
mod step_control;
mod systems;
mod task;
#[cfg(test)]
mod tests;

pub use crate::integration::BatchKernel;
pub use error::EnsembleError;
pub use member::{Ending, Member, Tally};
pub use members::Lagrangians;
pub use observed::ObservedEnsemble;
pub use sharded::{Merge, ShardedEnsemble};
pub use systems::Systems;
