//! Motions and paths: the statements of the paper, integrators and their runs, ensembles, impacts, paths between given
//! ends, and invalid input. One binary, in which each integrator is compiled once for each type of Lagrangian.

#![allow(missing_docs)]
// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
// In a test a missing value is a failure.
#![allow(clippy::panic, clippy::unwrap_used, clippy::expect_used)]
// `!(x <= bound)` holds for a NaN, as the checks intend; an index says which stage or coordinate it is.
#![allow(clippy::neg_cmp_op_on_partial_ord, clippy::needless_range_loop)]

// Other targets use the rest of it.
#[allow(dead_code)]
#[path = "../common/mod.rs"]
mod common;
// Other targets use the rest of it.
#[allow(dead_code)]
#[path = "../common/counting_allocator.rs"]
mod counting_allocator;

mod any_system;
mod boundary_paths;
mod ensembles;
mod forces;
mod integrators;
mod invalid_input;
mod lagrangians;
mod motions;
mod no_allocation;
mod paper;
mod path_branches;
mod resets;
