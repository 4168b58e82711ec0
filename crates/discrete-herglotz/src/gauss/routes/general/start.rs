//! The stages of a general step before its iteration.

use crate::gauss::routes::general::General;
use crate::gauss::routes::general::vectors::Vectors;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::blocks;
use pulp::{Simd, WithSimd};

/// Extrapolates the stages of the last step, if they are to be, and computes the positions and actions of the stages.
pub(crate) struct StartStep<'b> {
    pub general: &'b mut General,
    pub extrapolates: bool,
}

impl WithSimd for StartStep<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) {
        let StartStep { general, extrapolates } = self;
        if extrapolates {
            general.extrapolate::<S>();
            if general.newton.is_some() {
                let General { table, rate, one_minus_rho_stages, .. } = &mut *general;
                table.m.apply(rate, table.s, one_minus_rho_stages, Lanes::<S>::splat(0.0));
            }
        }
        general.stage_positions::<S>();
    }
}

impl General {
    /// The predictor of a step: extrapolates the polynomials of the last step.
    #[inline(always)]
    fn extrapolate<S: Simd>(&mut self) {
        let s = self.table.s;
        let renewed = 1.0 / (1.0 - self.one_minus_rho);
        let Vectors { v, l_v, force, .. } = self.vectors.split();
        let rates = if self.transformed { Some(&mut self.extension.g) } else { None };
        let StageTable { extrapolation, extrapolation_weighted, .. } = &self.table;
        for x in v.iter_mut().chain(l_v).chain(rates) {
            let before = *x;
            extrapolation.apply(&before, s, x, Lanes::<S>::splat(0.0));
        }
        // rho is 1 at the start of each step.
        let scaled = force.iter_mut().chain([&mut self.rate]).map(|x| (x, renewed));
        for (x, factor) in scaled.chain([(&mut self.l, 1.0)]) {
            let before = *x;
            extrapolation_weighted.apply(&before, s, x, Lanes::<S>::splat(0.0));
            for r in 0..blocks::<S>(s) {
                x.set(r, x.block::<S>(r) * factor);
            }
        }
    }

    /// Computes the positions and the actions of the stages from their velocities and values of L.
    #[inline(always)]
    fn stage_positions<S: Simd>(&mut self) {
        self.weighted_velocities::<S>();
        let (m, s) = (&self.m, self.table.s);
        let Vectors { moved, x, .. } = self.vectors.split();
        for ((q, moved), x) in self.q.iter().zip(moved).zip(x) {
            let q = Lanes::<S>::splat(q.value);
            m.apply(moved, s, x, q);
        }
        let z = Lanes::<S>::splat(self.z.value);
        m.apply(&self.l, s, &mut self.z_stages, z);
    }

    /// Computes the stage velocities multiplied by the weights, and by g in transformed time.
    #[inline(always)]
    pub(crate) fn weighted_velocities<S: Simd>(&mut self) {
        let Vectors { v, moved, .. } = self.vectors.split();
        for r in 0..blocks::<S>(self.table.s) {
            let mut weight = self.table.weights.block::<S>(r);
            if self.transformed {
                weight *= self.extension.g.block(r);
            }
            for (moved, v) in moved.iter_mut().zip(&*v) {
                moved.set(r, weight * v.block(r));
            }
        }
    }
}
