//! What a run checks along its way: claims of structure, the energy, steps against two halves, jumps of the acceleration.

pub(crate) mod acceleration_jump;
pub(crate) mod claims;
pub(crate) mod energy;
pub(crate) mod half_steps;
