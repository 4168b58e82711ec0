//! Sparse systems: agreement with small ones, conservation, orders, invalid input.

// In a test a missing value is a failure.
#![allow(missing_docs, clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod bad_input;
mod bits;
mod catalogue;
mod compensated;
mod drag;
mod flags;
mod friction;
mod gauss;
mod matrix_free;
mod no_allocation;
mod rods;
mod small_systems;
mod theory;
