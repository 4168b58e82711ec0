//! Whether a step resolves the motion, judged by the last Legendre coefficient of its stages and by its conformal
//! factor.

use crate::gauss::tables::coefficients::Coefficients;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use contact_geom::numbers::max_or_nan;
use pulp::Simd;

/// The error of `ln sigma_d` in a step above which the step does not resolve the drag: a tenth. The Gauss method with
/// one stage reaches it at `gamma h = 1`, where the factor changes by e.
const SIGMA: f64 = 0.1;

/// The last Legendre coefficient of the stages, in units of the largest stage, above which a polynomial of their degree
/// does not approximate the motion: one half. A harmonic motion reaches it with three to four stages per period; if a
/// step resolves the motion, the coefficients decrease geometrically.
const TAIL: f64 = 0.5;

/// The displacement by the last coefficient, relative to the positions, below which the stages are taken for round-off.
pub(crate) const MOVED: f64 = 1e-8;

/// The change of the first iteration, relative to the stages, above which their last coefficient is checked. A step
/// that the last step's polynomial predicts to a tenth is resolved.
pub(crate) const FORETOLD: f64 = 0.1;

/// The round-off of a defect, or of a converged iteration, in units of the round-off of one force or momentum: for
/// sixteen stages and the weights of an interpolation between them.
pub(crate) const ROUNDINGS: f64 = 256.0;

/// The defect of a conformal factor: the difference of `ln sigma_d` and the integral of `L_z`, above one if the step
/// does not resolve the drag.
pub(crate) fn of_sigma(sigma: f64, integral: f64) -> f64 {
    (sigma.ln() - integral).abs() / SIGMA
}

/// The linear functional that gives the last Legendre coefficient of a polynomial from its values at the stages.
pub(crate) struct Tail {
    s: usize,
    weights: Stages,
}

impl Tail {
    pub fn new(s: usize) -> Self {
        Tail { s, weights: Stages(Coefficients::of(s).last[0]) }
    }

    /// The defect of a step from the values at its stages, times a factor if one is given: above one if a polynomial
    /// does not approximate them. `values * time` has the units of the positions, with which the last coefficient is
    /// compared. For one and two stages the result is 0, since the last coefficient then says nothing beyond the order
    /// of the step. All values must be finite.
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
        if tail * time > MOVED * width.reduce_max() { tail / (TAIL * size.reduce_max()) } else { 0.0 }
    }
}
