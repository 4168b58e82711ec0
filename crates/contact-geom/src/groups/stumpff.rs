//! Stumpff's functions, the coefficients of the exponential map of rotations.

use crate::Scalar;

/// Below this argument the functions are summed as power series; above it their closed forms lose less than two bits.
const SERIES_BELOW: f64 = 2.5;

/// The number of terms: `2.5^12/(2*12+4)!` is below the round-off of `c_4`, and so are its first two derivatives.
const TERMS: usize = 12;

/// Stumpff's functions `c_k(x) = sum_j (-x)^j / (2j + k)!` for k from 0 to 5, at `x = theta^2`: `c_0 = cos theta`,
/// `c_1 = sin theta / theta`, `c_2 = (1 - cos theta)/theta^2`, `c_3 = (theta - sin theta)/theta^3`, and
/// `c_(k+2) = (1/k! - c_k)/x`. Their derivatives are `2x c_k' = c_(k-1) - k c_k`.
pub(super) fn stumpff<T: Scalar>(x: T) -> [T; 6] {
    if x.re() < SERIES_BELOW {
        let series = |k: usize| {
            let mut sum = T::one();
            for j in (1..=TERMS).rev() {
                let last = 2 * j + k;
                sum = sum * x * (-1.0 / ((last * (last - 1)) as f64)) + 1.0;
            }
            sum
        };
        let (c4, c5) = (series(4) / 24.0, series(5) / 120.0);
        let (c2, c3) = (-(x * c4) + 0.5, -(x * c5) + 1.0 / 6.0);
        [-(x * c2) + 1.0, -(x * c3) + 1.0, c2, c3, c4, c5]
    } else {
        let theta = x.sqrt();
        let (sin, versine) = theta.sin_versine();
        let inverse = x.recip();
        let (c1, c2) = (sin / theta, versine * inverse);
        let c3 = (-c1 + 1.0) * inverse;
        [-versine + 1.0, c1, c2, c3, (-c2 + 0.5) * inverse, (-c3 + 1.0 / 6.0) * inverse]
    }
}

/// `atan(y)/y` at `x = y^2`.
pub(super) fn arc_tangent_ratio<T: Scalar>(x: T) -> T {
    if x.re() < 0.04 {
        // 0.04^12/25 is below the round-off.
        let mut sum = T::zero();
        for j in (0..=13).rev() {
            sum = -(sum * x) + 1.0 / (2.0 * f64::from(j) + 1.0);
        }
        sum
    } else {
        let y = x.sqrt();
        y.atan() / y
    }
}
