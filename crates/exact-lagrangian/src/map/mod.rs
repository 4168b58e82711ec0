//! The contact exponential map, its inverse, and what is made of them: the exact discrete Lagrangian and the exact flow.

pub(crate) mod conjugate;
pub(crate) mod exact_flow;
pub(crate) mod exact_lagrangian;
pub(crate) mod exponential;
pub(crate) mod joined_steps;
pub(crate) mod retraction;
mod shooting;

pub(crate) use shooting::ITERATIONS;
