//! Bracketed roots of functions of one variable.

/// A root of a function on `[0, 1]` between two points with values of opposite signs, to round-off, by the ITP method
/// of Oliveira and Takahashi (ACM Transactions on Mathematical Software 47, 2021): the regula falsi point is truncated
/// towards the middle and projected, so that the number of evaluations exceeds that of bisection by at most one.
pub(crate) fn bracketed_root<E>(
    ends: [f64; 2],
    values: [f64; 2],
    f: impl FnMut(f64) -> Result<f64, E>,
) -> Result<f64, E> {
    // The spacing of the numbers in [1/2, 1).
    bracketed_root_within(0.5 * f64::EPSILON, ends, values, f)
}

/// A root as found by [`bracketed_root`], to within a half-width.
pub(crate) fn bracketed_root_within<E>(
    half_width: f64,
    [mut a, mut b]: [f64; 2],
    [mut below, mut above]: [f64; 2],
    mut f: impl FnMut(f64) -> Result<f64, E>,
) -> Result<f64, E> {
    let rising = (above - below).signum();
    let bisections = ((b - a) / (2.0 * half_width)).log2().ceil() as i32;
    let truncation = 0.2 / (b - a);
    for j in 0..=bisections + 1 {
        if b - a <= 2.0 * half_width {
            break;
        }
        let middle = 0.5 * (a + b);
        let radius = (half_width * f64::powi(2.0, bisections + 1 - j) - 0.5 * (b - a)).max(0.0);
        let secant = (above * a - below * b) / (above - below);
        let direction = (middle - secant).signum();
        let shift = truncation * (b - a).powi(2);
        let truncated = if shift <= (middle - secant).abs() { secant + direction * shift } else { middle };
        let x = if (truncated - middle).abs() <= radius { truncated } else { middle - direction * radius };
        let value = f(x)?;
        if value == 0.0 {
            return Ok(x);
        }
        if value * rising > 0.0 {
            (b, above) = (x, value);
        } else {
            (a, below) = (x, value);
        }
    }
    Ok(0.5 * (a + b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// A simple root, a triple root and a jump are found to round-off in at most one evaluation more than bisection;
    /// the simple root in far fewer.
    #[test]
    fn roots_are_found_to_round_off() {
        let root = |f: &dyn Fn(f64) -> f64| {
            let mut count = 0;
            let found = bracketed_root([0.0, 1.0], [f(0.0), f(1.0)], |x| {
                count += 1;
                Ok::<_, Infallible>(f(x))
            });
            (found.unwrap_or(f64::NAN), count)
        };
        let near = |x: f64, expected: f64| (x - expected).abs() <= f64::EPSILON;
        let (x, count) = root(&|x| x.exp() - 1.5);
        assert!(near(x, 1.5f64.ln()) && count <= 15, "{x}, {count}");
        // Values of `(x - r)^3` vanish only to the round-off of x.
        let (x, count) = root(&|x| (x - 0.3).powi(3));
        assert!(near(x, 0.3) && count <= 54, "{x}, {count}");
        let (x, count) = root(&|x| if x < 0.7 { -1e300 } else { 1e-300 });
        assert!(near(x, 0.7) && count <= 54, "{x}, {count}");
    }
}
