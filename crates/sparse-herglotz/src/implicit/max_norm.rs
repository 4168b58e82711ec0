//! The maximum norm of a vector.

/// The largest absolute component; infinite if a component is NaN, so that no comparison with a bound succeeds.
pub(crate) fn max_norm(x: &[f64]) -> f64 {
    let mut largest = 0.0f64;
    let mut sum = 0.0;
    for x in x {
        largest = largest.max(x.abs());
        sum += x;
    }
    if sum.is_nan() { f64::INFINITY } else { largest }
}
