//! The parts of a step before and after its iteration: the predictor, the end of the step, and its defect.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::limits::MAX_UNCHECKED_FACTOR_CHANGE;
use crate::gauss::resolution::tail::of_sigma;
use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::numbers::compensated::{Unevaluated, add, finite};
use crate::numbers::lanes::{Lanes, branched};
use crate::numbers::registers::blocks;
use crate::resolution::thresholds::MIN_CHECKED_CHANGE;
use contact_geom::numbers::max_or_nan;
use pulp::{Simd, WithSimd};

/// The predictor of a step.
pub(super) struct Extrapolate<'b> {
    pub stages: &'b mut HamiltonianStages,
}

impl WithSimd for Extrapolate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        self.stages.extrapolate::<S>();
    }
}

/// The end of a step from its stages, and its defect; `first` is the relative error of its predictor.
pub(super) struct FinishStep<'b> {
    pub stages: &'b mut HamiltonianStages,
    pub first: f64,
}

impl WithSimd for FinishStep<'_> {
    type Output = IterationOutcome;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> IterationOutcome {
        let outcome = self.stages.finish::<S>();
        self.stages.assess_resolution::<S>(self.first);
        outcome
    }
}

impl HamiltonianStages {
    /// Extrapolates the polynomials of the last step. rho is 1 at the start of each step.
    #[inline(always)]
    fn extrapolate<S: Simd>(&mut self) {
        let (s, n, renewed) = (self.table.s, self.q.len(), 1.0 / (1.0 - self.one_minus_rho));
        let map = self.table.extrapolation_weighted;
        for (c, x) in self.rows.right_hand_sides_mut().iter_mut().enumerate() {
            // The right-hand sides of P and 1 - rho, unlike those of q and z, are multiples of rho.
            let factor = if c < n || c == 2 * n { 1.0 } else { renewed };
            let before = *x;
            map.apply(&before, s, x, Lanes::<S>::splat(0.0));
            for r in 0..blocks::<S>(s) {
                x.set(r, x.block::<S>(r) * factor);
            }
        }
    }

    /// The end of the step from its stages.
    #[inline(always)]
    fn finish<S: Simd>(&mut self) -> IterationOutcome {
        let (s, n) = (self.table.s, self.q.len());
        let (one_minus_rho, dz) = (self.rows.rate().sum::<S>(s), self.rows.l().sum::<S>(s));
        let mut deepest = Lanes::<S>::splat(f64::NEG_INFINITY);
        for r in 0..blocks::<S>(s) {
            deepest = deepest.max(self.rows.one_minus_rho().block::<S>(r));
        }
        let rho = 1.0 - deepest.reduce_max();
        if rho <= 0.0 {
            return IterationOutcome::StageFactor { rho };
        }
        if one_minus_rho >= 1.0 {
            return IterationOutcome::SigmaVanished { sigma: 1.0 / (1.0 - one_minus_rho) };
        }
        // sigma_d - 1: adding this to 1 would round it if the rate is small.
        let grow = one_minus_rho / (1.0 - one_minus_rho);
        let [dq, dp] = &mut self.increments;
        for d in 0..n {
            dq[d] = Unevaluated { head: self.rows.moved()[d].sum::<S>(s), tail: 0.0 };
            let pushed = self.rows.force()[d].sum::<S>(s);
            dp[d] = Unevaluated { head: pushed, tail: grow * (pushed + self.p[d].value) };
        }
        if branched() {
            return IterationOutcome::Branched;
        }
        let dz = Unevaluated { head: dz, tail: 0.0 };
        // The maximum over lanes may hide a NaN; a NaN in `one_minus_rho` shows in `dp`.
        if !finite(dq, dp, dz) || !one_minus_rho.is_finite() {
            return IterationOutcome::NonFinite;
        }
        add(&mut self.q, dq);
        add(&mut self.p, dp);
        self.z.add(dz);
        self.one_minus_rho = one_minus_rho;
        for (known, v) in self.known.iter_mut().zip(self.rows.v()) {
            *known = v.0[s - 1];
        }
        self.warm = true;
        IterationOutcome::Done
    }

    /// Sets the defect of the last step, of velocities, momenta and the conformal factor. `first` is the relative error
    /// of its predictor; the stages are checked only if it is large.
    #[inline(always)]
    fn assess_resolution<S: Simd>(&mut self, first: f64) {
        let rows = &self.rows;
        self.defect = 0.0;
        if first > MIN_CHECKED_CHANGE {
            let of_velocities = self.tail.defect::<S>(rows.v(), None, rows.x(), self.table.h);
            let of_momenta = self.tail.defect::<S>(rows.p(), None, rows.p(), 1.0);
            self.defect = max_or_nan(of_velocities, of_momenta);
        }
        if first > MIN_CHECKED_CHANGE || self.one_minus_rho.abs() > MAX_UNCHECKED_FACTOR_CHANGE {
            let one = Lanes::<S>::splat(1.0);
            let mut integral = Lanes::<S>::splat(0.0);
            for r in 0..blocks::<S>(self.table.s) {
                integral += rows.rate().block::<S>(r) / (one - rows.one_minus_rho().block(r));
            }
            self.defect = max_or_nan(self.defect, of_sigma(1.0 / (1.0 - self.one_minus_rho), integral.sum()));
        }
    }
}
