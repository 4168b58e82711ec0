//! Whether a step resolves the motion, measured by the last Legendre coefficient of its stages and by its conformal
//! factor.

use crate::gauss::tables::coefficients::Coefficients;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use crate::resolution::thresholds::{FEW_STAGES, MAX_LAST_COEFFICIENT, MAX_LOG_FACTOR_ERROR, STAGE_ROUND_OFF};
use contact_geom::numbers::max_or_nan;
use pulp::Simd;

/// The defect of a conformal factor: the difference of `ln sigma_d` and the integral of `L_z`, above one if the step
/// does not resolve the drag.
pub(crate) fn of_sigma(sigma: f64, integral: f64) -> f64 {
    (sigma.ln() - integral).abs() / MAX_LOG_FACTOR_ERROR
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
    /// compared. For at most [`FEW_STAGES`] stages the result is 0, since the last coefficient then says nothing beyond
    /// the order of the step. All values must be finite.
    #[inline(always)]
    pub fn defect<S: Simd>(&self, values: &[Stages], factor: Option<&Stages>, positions: &[Stages], time: f64) -> f64 {
        if self.s <= FEW_STAGES {
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
        if tail * time > STAGE_ROUND_OFF * width.reduce_max() {
            tail / (MAX_LAST_COEFFICIENT * size.reduce_max())
        } else {
            0.0
        }
    }
}
