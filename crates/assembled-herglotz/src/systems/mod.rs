//! A catalogue of assembled systems.

mod chain;
mod lattice;
mod solar;

pub use chain::{FputBond, fput_chain};
pub use lattice::{KleinGordon, SineGordon, Spring, lattice};
pub use solar::{Gravitation, OuterSolarSystem, bodies};
