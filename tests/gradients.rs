//! Derivatives of runs: tangents, gradients by the adjoint, and differences of runs.

#![allow(missing_docs)]
// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
// In a test a missing value is a failure.
#![allow(clippy::panic, clippy::unwrap_used)]

mod gradients {
    mod agreement;
    mod contact;
    mod ensembles;
    mod flows;
    mod forces;
    mod impacts;
    mod invalid_input;
    mod lagrangians;
    mod losses;
    mod lyapunov;
    mod pendulum;
    mod runs;
    mod switches;
}
