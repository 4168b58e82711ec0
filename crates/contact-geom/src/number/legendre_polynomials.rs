//! Legendre polynomials.

use std::ops::{Add, Div, Mul, Sub};

/// The Legendre polynomials `P_0(x) .. P_s(x)` on `[-1, 1]`, by Bonnet's recursion, as many as fit into the array; the
/// entries beyond `P_s` are 1. The number type is generic, since the nodes of Gauss collocation are needed in different
/// precisions.
///
/// ```
/// let p: [f64; 4] = contact_geom::support::legendre_polynomials(3, 0.5);
/// assert_eq!(p, [1.0, 0.5, -0.125, -0.4375]);
/// ```
pub fn legendre_polynomials<T, const M: usize>(s: usize, x: T) -> [T; M]
where
    T: Copy + From<f64> + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Div<Output = T>,
{
    let mut p = [T::from(1.0); M];
    if let Some(first) = p.get_mut(1) {
        *first = x;
    }
    for k in 1..s.min(M.saturating_sub(1)) {
        let n = T::from(k as f64);
        p[k + 1] = ((n + n + T::from(1.0)) * x * p[k] - n * p[k - 1]) / (n + T::from(1.0));
    }
    p
}
