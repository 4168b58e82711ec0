//! Derivatives of runs: tangents, and gradients by the adjoint, of built-in integrators and of
//! discrete Lagrangians of a user. One binary, in which each of them is compiled once for each type of Lagrangian.

#![allow(missing_docs)]
// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
// In a test a missing value is a failure.
#![allow(clippy::panic, clippy::unwrap_used)]

// Other targets use the rest of it.
#[allow(dead_code)]
#[path = "../common/counting_allocator.rs"]
mod counting_allocator;
mod discrete_tangents;
mod gradients;
mod lagrangians;
