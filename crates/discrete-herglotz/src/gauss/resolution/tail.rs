//! Whether a step resolves the motion that it crosses.

use crate::gauss::tables::coefficients::Coefficients;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use contact_geom::numbers::max_or_nan;
use pulp::Simd;

/// The relative error of `sigma_d` in a step from which on the step does not resolve the drag: a tenth. Gauss' method with one
/// stage reaches it at `gamma h = 1`, where the factor changes by e.
const SIGMA: f64 = 0.1;

/// The last coefficient of the stages in the Legendre polynomials, in units of the largest stage, from which on they are not
/// the values of a function that a polynomial of their degree follows: one half. A harmonic reaches it with three to four
/// stages a period; where a step resolves the motion the coefficients fall geometrically.
const TAIL: f64 = 0.5;

/// What a tail must move of the positions to count: below it the stages are round-off.
pub(crate) const MOVED: f64 = 1e-8;

/// The change of a sweep, relative to the stages, from which on their tail is looked at: what the last step's polynomial has
/// foretold to a tenth is resolved.
pub(crate) const FORETOLD: f64 = 0.1;

/// The roundings of a force or momentum that a misfit, or what an iteration leaves, may hold: sixteen stages, with the weights of an
/// interpolation between them.
pub(crate) const ROUNDINGS: f64 = 256.0;

/// The misfit of a conformal factor: `ln sigma_d` against the integral of `L_z`; above one where the step does not resolve it.
pub(crate) fn of_sigma(sigma: f64, integral: f64) -> f64 {
    (sigma.ln() - integral).abs() / SIGMA
}

/// The functional that takes the last coefficient of a polynomial from its values at the stages.
pub(crate) struct Tail {
    s: usize,
    weights: Stages,
}

impl Tail {
    pub fn new(s: usize) -> Self {
        Tail { s, weights: Stages(Coefficients::of(s).last[0]) }
    }

    /// The misfit of a step by the values at its stages, times a factor where one is given: above one where they are not those of a
    /// polynomial. `time` turns them to lengths that are compared with the positions. Up to two stages do not tell: a step is then no
    /// worse than its order. All must be finite.
    #[inline(always)]
    pub fn defect<S: Simd, const N: usize>(
        &self,
        values: &[Stages; N],
        factor: Option<&Stages>,
        positions: &[Stages; N],
        time: f64,
    ) -> f64 {
        if self.s < 3 {
            return 0.0;
        }
        let zero = Lanes::<S>::splat(0.0);
        let (mut tail, mut size, mut width) = (0.0, zero, zero);
        for (d, x) in positions.iter().enumerate() {
            let mut last = zero;
            for r in 0..blocks::<S>(self.s) {
                let mut value = values[d].block::<S>(r);
                if let Some(factor) = factor {
                    value *= factor.block(r);
                }
                last = self.weights.block(r).mul_add(value, last);
                size = size.max(value.abs());
                width = width.max(x.block(r).abs());
            }
            tail = max_or_nan(tail, last.sum().abs());
        }
        if tail * time > MOVED * width.max_abs_or_nan() { tail / (TAIL * size.max_abs_or_nan()) } else { 0.0 }
    }
}
