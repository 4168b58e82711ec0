//! The exponential of a matrix, without the identity.

use contact_geom::nalgebra::DMatrix;
use contact_geom::numbers::max_abs_or_nan;

/// The number of terms of the series: the remainder is below round-off for a norm of 1/4.
const TERMS: u32 = 14;

/// `e^A - 1`, without cancellation where A is small: the series for `A/2^k`, and k times `d -> 2 d + d^2`. NaN where an
/// entry is not finite.
pub(super) fn exponential_minus_one(a: &DMatrix<f64>) -> DMatrix<f64> {
    let norm = a.nrows() as f64 * max_abs_or_nan(a.iter().copied());
    if !norm.is_finite() {
        return a.map(|_| f64::NAN);
    }
    // `e^norm` overflows long before this bound on the number of squarings is reached.
    let halvings = if norm > 0.25 { (4.0 * norm).log2().ceil().clamp(0.0, 64.0) as i32 } else { 0 };
    let small = a * 0.5f64.powi(halvings);
    // Horner: A (1 + A/2 (1 + A/3 (...))).
    let identity = DMatrix::identity(a.nrows(), a.ncols());
    let mut sum = identity.clone();
    for k in (2..=TERMS).rev() {
        sum = &identity + (&small * sum) / f64::from(k);
    }
    let mut d = small * sum;
    for _ in 0..halvings {
        d = &d * 2.0 + &d * &d;
    }
    d
}
