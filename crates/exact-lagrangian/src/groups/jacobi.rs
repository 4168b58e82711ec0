//! Jacobi's elliptic functions.

/// `(sn, cn, dn)(u)` of the modulus k with the complementary modulus k', `k^2 + k'^2 = 1`; both are given, since either
/// may be close to 1.
///
/// By the arithmetic-geometric mean and descending Landen transformations: Abramowitz and Stegun, 16.4. The error is a
/// few eps for `|u|` up to one and grows as `eps |u|`, that of the argument.
///
/// ```
/// let [sn, cn, dn] = exact_lagrangian::groups::jacobi_functions(0.5, [0.8, 0.6]);
/// assert!((sn * sn + cn * cn - 1.0).abs() < 1e-15 && (dn * dn + 0.64 * sn * sn - 1.0).abs() < 1e-15);
/// ```
pub fn jacobi_functions(u: f64, [k, complementary]: [f64; 2]) -> [f64; 3] {
    if complementary == 0.0 {
        let sech = u.cosh().recip();
        return [u.tanh(), sech, sech];
    }
    // The mean converges quadratically; from k' = 1e-300 it takes 14 steps.
    const MOST: usize = 20;
    let (mut a, mut b) = (1.0, complementary);
    let mut ratios = [0.0; MOST];
    let mut n = 0;
    let mut c = k;
    while n < MOST && c.abs() > f64::EPSILON * a {
        c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        ratios[n] = c / a;
        n += 1;
    }
    let mut phi = (1u64 << n) as f64 * a * u;
    for ratio in ratios[..n].iter().rev() {
        phi = 0.5 * (phi + (ratio * phi.sin()).asin());
    }
    let (sn, cn) = phi.sin_cos();
    [sn, cn, (complementary * complementary + k * k * cn * cn).sqrt()]
}
