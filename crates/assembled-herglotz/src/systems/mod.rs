//! A catalogue of assembled systems.

mod chain;

pub use chain::{FputBond, fput_chain};
