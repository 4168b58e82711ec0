//! Robust losses.

/// A loss: what a residual r contributes to the cost, `C^2/2 rho((r/C)^2)`, where C is the `scale`, the size of a
/// residual above which it is taken as that of an outlier, in the units of the weighted residuals.
///
/// | Loss | `rho(s)` |
/// |---|---|
/// | `Linear` | `s`, that is least squares |
/// | `Huber` | `s` for `s <= 1`, else `2 sqrt(s) - 1` |
/// | `SoftL1` | `2 (sqrt(1 + s) - 1)` |
/// | `Cauchy` | `ln(1 + s)` |
///
/// These are the losses of SciPy's `least_squares`, with `f_scale = C`. The iteration minimises the sum of squares of
/// `sign(r) C sqrt(rho((r/C)^2))`, whose half is the cost itself; so every step is judged by the true cost, and the
/// gradient is the true one. Its Gauss-Newton matrix has the factor `rho'^2 s/rho`, which lies between that of
/// iteratively reweighted least squares, `rho'`, and the second derivative of the loss, `rho' + 2 s rho''` (Triggs et
/// al., Bundle adjustment, 1999), and is never negative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Loss {
    /// Least squares.
    #[default]
    Linear,
    /// Quadratic for small residuals, linear for large ones. With `scale` 1.345 standard deviations the estimate has 95 %
    /// of the efficiency of least squares where the errors are normal.
    Huber {
        /// The residual where outliers begin.
        scale: f64,
    },
    /// A smooth loss of the kind of Huber's.
    SoftL1 {
        /// The residual where outliers begin.
        scale: f64,
    },
    /// Large residuals have nearly no influence; the cost may then have several minima. Use several starts.
    Cauchy {
        /// The residual where outliers begin.
        scale: f64,
    },
}

/// What a loss makes of one residual.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LossTerm {
    /// `sign(r) C sqrt(rho)`, whose square is twice the cost.
    pub root: f64,
    /// Its derivative with respect to r.
    pub root_slope: f64,
    /// `psi = rho' r`, the derivative of the cost.
    pub influence: f64,
    /// `psi' = rho' + 2 s rho''`.
    pub influence_slope: f64,
}

impl Loss {
    /// The scale; `None` for least squares.
    pub fn scale(self) -> Option<f64> {
        match self {
            Loss::Linear => None,
            Loss::Huber { scale } | Loss::SoftL1 { scale } | Loss::Cauchy { scale } => Some(scale),
        }
    }

    /// The contribution of a residual to the cost, `C^2/2 rho((r/C)^2)`.
    pub fn cost(self, residual: f64) -> f64 {
        let root = self.term(residual).root;
        0.5 * root * root
    }

    pub(crate) fn term(self, r: f64) -> LossTerm {
        let Some(scale) = self.scale() else {
            return LossTerm { root: r, root_slope: 1.0, influence: r, influence_slope: 1.0 };
        };
        let a = (r / scale).abs();
        // sqrt(rho/s), rho' and psi'.
        let (factor, slope, influence_slope) = match self {
            Loss::Linear => (1.0, 1.0, 1.0),
            Loss::Huber { .. } if a <= 1.0 => (1.0, 1.0, 1.0),
            Loss::Huber { .. } => ((2.0 * a - 1.0).sqrt() / a, a.recip(), 0.0),
            Loss::SoftL1 { .. } => {
                let root = a.hypot(1.0);
                ((2.0 / (root + 1.0)).sqrt(), root.recip(), root.powi(-3))
            }
            Loss::Cauchy { .. } => {
                // The square overflows for very large residuals, and vanishes for very small ones.
                let rho = if a < 1e100 { (a * a).ln_1p() } else { 2.0 * a.ln() };
                let factor = if a < 1e-100 { 1.0 } else { rho.sqrt() / a };
                // rho' = 1/(1 + a^2), and a^2 rho'.
                let (slope, rest) = if a <= 1.0 {
                    let slope = (1.0 + a * a).recip();
                    (slope, a * a * slope)
                } else {
                    let inverse = a.recip();
                    (inverse / (a + inverse), (1.0 + inverse * inverse).recip())
                };
                (factor, slope, slope * (1.0 - 2.0 * rest))
            }
        };
        LossTerm { root: r * factor, root_slope: slope / factor, influence: slope * r, influence_slope }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rho(loss: Loss, s: f64) -> f64 {
        match loss {
            Loss::Linear => s,
            Loss::Huber { .. } => {
                if s <= 1.0 {
                    s
                } else {
                    2.0 * s.sqrt() - 1.0
                }
            }
            Loss::SoftL1 { .. } => 2.0 * ((1.0 + s).sqrt() - 1.0),
            Loss::Cauchy { .. } => s.ln_1p(),
        }
    }

    #[test]
    fn cost_and_derivatives_are_those_of_rho() {
        let scale = 0.7;
        for loss in [Loss::Linear, Loss::Huber { scale }, Loss::SoftL1 { scale }, Loss::Cauchy { scale }] {
            for r in [-40.0, -3.0, -0.9, -0.2, 1e-3, 0.5, 0.69, 0.75, 2.0, 300.0f64] {
                let term = loss.term(r);
                let c = if loss == Loss::Linear { 1.0 } else { scale };
                let expected = 0.5 * c * c * rho(loss, (r / c).powi(2));
                assert!((loss.cost(r) - expected).abs() <= 1e-10 * expected, "{loss:?} {r}");
                assert!((term.root * term.root_slope - term.influence).abs() <= 1e-14 * term.influence.abs());
                let h = 1e-6 * r.abs();
                let slope = |f: &dyn Fn(f64) -> f64| (f(r + h) - f(r - h)) / (2.0 * h);
                let bound = 1e-7 * (1.0 + expected / r.abs());
                assert!((slope(&|r| loss.cost(r)) - term.influence).abs() < bound, "{loss:?} {r}");
                assert!((slope(&|r| loss.term(r).influence) - term.influence_slope).abs() < 1e-7, "{loss:?} {r}");
                assert!((slope(&|r| loss.term(r).root) - term.root_slope).abs() < 1e-7, "{loss:?} {r}");
            }
        }
    }

    #[test]
    fn extreme_residuals_are_finite_and_in_order() {
        for loss in [Loss::Huber { scale: 1.0 }, Loss::SoftL1 { scale: 1.0 }, Loss::Cauchy { scale: 1.0 }] {
            let roots = [0.0, 1e-300, 1e-160, 1e-8, 1.0, 1e8, 1e101, 1e160, 1e300].map(|r| loss.term(r));
            assert!(roots.iter().all(|t| t.root.is_finite() && t.root_slope.is_finite() && t.influence.is_finite()));
            assert!(roots.windows(2).all(|w| w[0].root < w[1].root), "{loss:?}: {roots:?}");
            assert!(roots.iter().all(|t| t.influence_slope.is_finite()), "{loss:?}: {roots:?}");
        }
    }
}
