//! The contact exponential map and its inverse, the exact discrete Lagrangian and the exact flow.

pub(crate) mod conjugate;
pub(crate) mod exact_flow;
pub(crate) mod exact_lagrangian;
pub(crate) mod exponential;
pub(crate) mod joined_steps;
mod retract;
pub(crate) mod retraction;
mod shooting;
mod velocity_seed;
