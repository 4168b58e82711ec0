//! Second derivatives of runs, against differences of first ones, closed forms and each other.

#![allow(missing_docs)]
// In a check `f64::max` and `amax` would lose a NaN.
#![deny(clippy::disallowed_methods)]
// In a test a missing value is a failure.
#![allow(clippy::panic, clippy::unwrap_used)]

mod second_derivatives {
    mod closed_form;
    mod differences;
    mod invalid_input;
    mod systems;
}
