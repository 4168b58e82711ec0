//! Integrals of exponentials.

use crate::gauss::tables::coefficients::Coefficients;

/// Below this exponent the moment is computed by quadrature, which has no cancellation; its error is then below round-off.
const SMALL_EXPONENT: f64 = 1.0;

/// The number of nodes of that quadrature, of order 20.
const NODES: usize = 10;

/// The integral of `e^(rate u)` over u from 0 to s.
pub(super) fn length(rate: f64, s: f64) -> f64 {
    if rate == 0.0 { s } else { (rate * s).exp_m1() / rate }
}

/// The integral of `u e^(rate u)` over u from 0 to s: the derivative of [`length`] in the rate.
pub(super) fn moment(rate: f64, s: f64) -> f64 {
    let x = rate * s;
    if x.abs() > SMALL_EXPONENT {
        return (s * x.exp() - length(rate, s)) / rate;
    }
    let g = Coefficients::of(NODES);
    s * s * (0..NODES).map(|j| g.b[j].0 * g.c[j].0 * (x * g.c[j].0).exp()).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The two formulas agree where they meet, and the moment without a rate is `s^2/2`.
    #[test]
    fn moments() {
        assert!((moment(0.0, -0.4) - 0.08).abs() <= 1e-16);
        for s in [0.5, 2.0, -0.5, -2.0] {
            let rate = 1.0 / s;
            let [below, above] = [moment(rate * (1.0 - 1e-12), s), moment(rate * (1.0 + 1e-12), s)];
            assert!((below / above - 1.0).abs() <= 1e-11, "s = {s}: {below} and {above}");
        }
    }
}
