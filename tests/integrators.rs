//! Integrators: steppers, runs, dense output and events, over the catalogue of systems.

#![allow(missing_docs)]
// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
// In a test a missing value is a failure.
#![allow(clippy::panic, clippy::unwrap_used, clippy::needless_range_loop, clippy::neg_cmp_op_on_partial_ord)]

// Other targets use the rest of it.
#[allow(dead_code, unused_imports)]
mod common;

mod accuracy;
mod conformal_steppers;
mod dense_output;
mod event_roots;
mod events;
mod every_run;
mod forces;
mod gauss;
mod gauss_catalogue;
mod gauss_stress;
#[path = "integrators/lagrangians.rs"]
mod lagrangians;
mod round_off;
mod runs;
mod transformed_time;
