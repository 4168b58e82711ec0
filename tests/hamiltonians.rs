//! Contact Hamiltonians given directly: contact Gauss collocation whatever the rank of `H_pp`, and runs on it.

#![allow(missing_docs)]
// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
// In a test a missing value is a failure.
#![allow(clippy::panic, clippy::unwrap_used, clippy::needless_range_loop, clippy::neg_cmp_op_on_partial_ord)]

// Other targets use the rest of it.
#[allow(dead_code, unused_imports)]
mod common;

#[path = "hamiltonians/catalogue.rs"]
mod catalogue;
#[path = "hamiltonians/derivatives.rs"]
mod derivatives;
#[path = "hamiltonians/modified.rs"]
mod modified;
#[path = "hamiltonians/runs.rs"]
mod runs;
#[path = "hamiltonians/steps.rs"]
mod steps;
#[path = "hamiltonians/systems.rs"]
mod systems;
