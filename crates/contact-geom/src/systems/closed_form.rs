//! Quotients that closed forms are written with, without loss of digits at 0.

/// `(e^x - 1) / x`, and 1 at 0.
pub(super) fn relative_exp_m1(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.exp_m1() / x }
}

/// `sin(x) / x`, and 1 at 0.
pub(super) fn relative_sin(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.sin() / x }
}
