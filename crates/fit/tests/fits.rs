//! Fits of motions and of other models: recovery, robust losses, bounds, rank, invalid input.

// In a test a missing value is a failure.
#![allow(missing_docs)]

mod bounds;
mod failures;
mod linear;
mod motions;
mod multi_start;
mod multiple_shooting;
mod noise;
mod rank;
mod recovery;
mod robust;
mod spring;
