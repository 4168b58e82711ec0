//! A catalogue of sparse systems.

mod chain;
mod cloth;
mod lattice;
mod rods;
mod solar;
mod wave;

pub use chain::{FputBond, fput_chain};
pub use cloth::{LengthSpring, Weight, cloth};
pub use lattice::{KleinGordon, SineGordon, Spring, lattice};
pub use rods::{RodChain, RodNet};
pub use solar::{Gravitation, OuterSolarSystem, bodies};
pub use wave::{ConsistentMass, Membrane, Mesh, consistent_membrane, membrane};
