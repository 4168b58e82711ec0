//! The parts of a step before and after its iteration: the predictor, the end of the step, and its defect.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::limits::MAX_UNCHECKED_FACTOR_CHANGE;
use crate::gauss::resolution::tail::of_sigma;
use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::increments::RightHandSides;
use crate::numbers::lanes::Lanes;
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
        let (s, rows) = (self.table.s, &self.rows);
        let of = RightHandSides {
            moved: rows.moved(),
            force: rows.force(),
            l: rows.l(),
            rate: rows.rate(),
            one_minus_rho: rows.one_minus_rho(),
        };
        let outcome = self.increments.sum::<S>(&of, s, &self.p);
        if outcome != IterationOutcome::Done {
            return outcome;
        }
        self.increments.add_to(&mut self.q, &mut self.p, &mut self.z);
        self.one_minus_rho = self.increments.one_minus_rho;
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
