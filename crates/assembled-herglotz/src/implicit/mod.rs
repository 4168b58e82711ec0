//! Implicit integrators: sparse nonlinear equations, solved with faer.

mod border;
mod corrections;
mod factors;
mod gauss;
mod krylov;
mod lu;
mod midpoint;
mod pattern;
mod second;
mod sparse;
mod stages;
#[cfg(test)]
mod tests;

pub use gauss::AssembledGauss;
pub use midpoint::AssembledMidpoint;
pub(crate) use pattern::{FullPattern, Pattern};

/// The largest absolute component; infinite if a component is NaN.
fn max_abs_or_nan(x: &[f64]) -> f64 {
    let mut largest = 0.0f64;
    let mut sum = 0.0;
    for x in x {
        largest = largest.max(x.abs());
        sum += x;
    }
    if sum.is_nan() { f64::INFINITY } else { largest }
}
