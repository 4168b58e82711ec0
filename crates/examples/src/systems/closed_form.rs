//! Quotients that occur in closed-form solutions, without loss of digits near 0.

/// `(e^x - 1) / x`, and 1 at 0.
pub(super) fn relative_exp_m1(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.exp_m1() / x }
}

/// `(e^x - 1 - x) / x^2`, and 1/2 at 0: the integral of `(1 - u) e^(x u)` over `[0, 1]`.
pub(super) fn second_relative_exp(x: f64) -> f64 {
    if x.abs() < 1.0 {
        // The sum of the terms x^k / (k + 2)!, from the last to the first.
        (3..=20).rev().fold(1.0, |sum, k| 1.0 + sum * x / f64::from(k)) * 0.5
    } else {
        (x.exp_m1() - x) / x / x
    }
}

/// `(e^(2x)/2 - 2 e^x + 3/2 + x) / x^3`, and 1/3 at 0: with `f = (e^x - 1)/x` and `g = (e^x - 1 - x)/x^2` it is
/// `(f^2/2 - g)/x`.
pub(super) fn third_relative_exp(x: f64) -> f64 {
    if x.abs() < 1.0 {
        // The sum of the terms (2^(k-1) - 2) x^(k-3) / k!, from the last to the first.
        (3..=28).rev().fold(0.0, |sum, k| 2.0_f64.powi(k - 1) - 2.0 + sum * x / f64::from(k + 1)) / 6.0
    } else {
        let e = x.exp_m1();
        (e * e * 0.5 - (e - x)) / x / x / x
    }
}

/// `sin(x) / x`, and 1 at 0.
pub(super) fn relative_sin(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { x.sin() / x }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_and_the_closed_forms_are_one_function() {
        // Where both are accurate. Three terms of size one are divided by at least 1/8, which gives some 30 units of
        // round-off.
        for x in [-0.999_999, -0.75, -0.5, 0.5, 0.75, 0.999_999] {
            let e = f64::exp_m1(x);
            let (second, third) = ((e - x) / (x * x), (e * e * 0.5 - e + x) / (x * x * x));
            assert!((second_relative_exp(x) - second).abs() <= 16.0 * f64::EPSILON, "{x}");
            assert!((third_relative_exp(x) - third).abs() <= 32.0 * f64::EPSILON, "{x}");
        }
        assert_eq!((second_relative_exp(0.0), third_relative_exp(0.0)), (0.5, 1.0 / 3.0));
        // e^x + e^(-x) - 2 = 4 sinh^2(x/2), which has no cancellation.
        for x in [1e-9, 1e-3, 0.1, 0.99, 1.01, 3.0, 30.0] {
            let (sum, root) = (second_relative_exp(x) + second_relative_exp(-x), (x * 0.5).sinh() / (x * 0.5));
            assert!((sum - root * root).abs() <= 16.0 * f64::EPSILON * sum, "{x}");
        }
        // For large negative x only the polynomial terms remain.
        assert!((third_relative_exp(-1e3) - 998.5e-9).abs() <= 4.0 * f64::EPSILON * 1e-6);
    }
}
