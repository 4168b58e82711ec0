//! The end of a general step, and checks of its solved stages: whether they satisfy their equations, and whether the step
//! resolves the motion.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::dense::Solved;
use crate::gauss::limits::MAX_UNCHECKED_FACTOR_CHANGE;
use crate::gauss::resolution::tail::of_sigma;
use crate::gauss::routes::general::General;
use crate::gauss::routes::general::vectors::Vectors;
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::stages::increments::RightHandSides;
use crate::gauss::system::SystemAtPoints;
use crate::numbers::compensated::Unevaluated;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use crate::resolution::monitor::value_rounding;
use crate::resolution::thresholds::{COLLOCATION_ROUNDINGS, MIN_CHECKED_CHANGE};
use contact_geom::numbers::max_or_nan;
use pulp::{Simd, WithSimd};

/// The end of a step from its stages, and its defect if the relative error of its predictor is given.
pub(crate) struct FinishStep<'b> {
    pub general: &'b mut General,
    pub first: Option<f64>,
}

impl WithSimd for FinishStep<'_> {
    type Output = IterationOutcome;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> IterationOutcome {
        let outcome = self.general.add_increments::<S>();
        if let Some(first) = self.first {
            self.general.assess_resolution::<S>(first);
        }
        outcome
    }
}

/// Whether the stages satisfy their equations to round-off, from the round-off of L and of its gradient.
struct CheckStages<'b> {
    general: &'b General,
    of_action: f64,
}

impl WithSimd for CheckStages<'_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> bool {
        let CheckStages { general, of_action } = self;
        let General { rounding, table, vectors, .. } = general;
        let rho = general.one_minus_rho_stages.map(|one_minus_rho_stages| 1.0 - one_minus_rho_stages);
        if !general.sums_to::<S>(1.0, &general.rate.map(|rate| -rate), 0.0, &rho)
            || !general.sums_to::<S>(general.z.value, &general.l, of_action, &general.z_stages)
        {
            return false;
        }
        for d in 0..general.p.len() {
            let of_momentum = rounding.q[d] * table.h.abs() + rounding.v[d];
            let mut momenta = Stages::ZERO;
            for i in 0..table.s {
                momenta.0[i] = rho.0[i] * vectors.l_v()[d].0[i];
            }
            if !general.sums_to::<S>(general.p[d].value, &vectors.force()[d], of_momentum, &momenta) {
                return false;
            }
        }
        true
    }
}

impl General {
    /// Advances the state by the increments of the step.
    #[inline(always)]
    fn add_increments<S: Simd>(&mut self) -> IterationOutcome {
        if self.transformed {
            // With the rates of the last evaluation.
            self.weighted_velocities::<S>();
        }
        let s = self.table.s;
        let Vectors { v, moved, force, .. } = self.vectors.split();
        let of =
            RightHandSides { moved, force, l: &self.l, rate: &self.rate, one_minus_rho: &self.one_minus_rho_stages };
        let outcome = self.increments.sum::<S>(&of, s, &self.p);
        if outcome != IterationOutcome::Done {
            return outcome;
        }
        if self.transformed {
            let mut dt = Stages::ZERO;
            for r in 0..blocks::<S>(s) {
                dt.set(r, self.table.weights.block::<S>(r) * self.extension.g.block(r));
            }
            let dt = dt.sum::<S>(s);
            let runs = self.extension.g.0[..s].iter().all(|g| *g > 0.0);
            if !(runs && dt.is_finite()) {
                return IterationOutcome::NonFinite;
            }
            let single = |head| Unevaluated { head, tail: 0.0 };
            self.extension.t.add(single(dt));
            self.extension.p_t.add(single(self.increments.grow * self.extension.p_t.value));
        }
        self.increments.add_to(&mut self.q, &mut self.p, &mut self.z);
        self.one_minus_rho = self.increments.one_minus_rho;
        for (known, v) in self.known.iter_mut().zip(v) {
            *known = v.0[s - 1];
        }
        self.warm = true;
        IterationOutcome::Done
    }

    /// Sets the defect of the last step. `first` is the relative error of its predictor; the stages are checked only if
    /// it is large, and the conformal factor also if it changes strongly.
    #[inline(always)]
    fn assess_resolution<S: Simd>(&mut self, first: f64) {
        self.defect = 0.0;
        if first > MIN_CHECKED_CHANGE {
            let rates = if self.transformed { Some(&self.extension.g) } else { None };
            let Vectors { v, x, .. } = self.vectors.split();
            self.defect = self.tail.defect::<S>(v, rates, x, self.table.h);
        }
        if first > MIN_CHECKED_CHANGE || self.one_minus_rho.abs() > MAX_UNCHECKED_FACTOR_CHANGE {
            let one = Lanes::<S>::splat(1.0);
            let mut integral = Lanes::<S>::splat(0.0);
            for r in 0..blocks::<S>(self.table.s) {
                integral += self.rate.block::<S>(r) / (one - self.one_minus_rho_stages.block(r));
            }
            self.defect = max_or_nan(self.defect, of_sigma(1.0 / (1.0 - self.one_minus_rho), integral.sum()));
        }
    }

    /// Whether the stages satisfy their equations to round-off although the velocities still change. This occurs if W
    /// is ill conditioned, and near an equilibrium, where the round-off of a force is that of its cancelling terms.
    #[cold]
    #[inline(never)]
    pub(crate) fn holds(&mut self, system: &dyn SystemAtPoints, t: f64) -> bool {
        let i = self.table.s / 2;
        self.take_stage(i);
        let of_value = system.rounding(t + self.table.times.0[i], self.point.at(), &mut self.rounding);
        let of_action = value_rounding(of_value, &self.rounding.q, &self.point.q) * self.table.h.abs();
        self.arch.dispatch(CheckStages { general: self, of_action })
    }

    /// Whether `start + M rates` is `sums` to round-off, relative to the terms of the sum.
    #[inline(always)]
    fn sums_to<S: Simd>(&self, start: f64, rates: &Stages, rounding: f64, sums: &Stages) -> bool {
        let (m, s) = (self.table.m, self.table.s);
        let mut sum = Stages::ZERO;
        m.apply(rates, s, &mut sum, Lanes::<S>::splat(0.0));
        for i in 0..s {
            let mut terms = start.abs();
            for j in 0..s {
                terms += (m.0[j].0[i] * rates.0[j]).abs();
            }
            let off = start + sum.0[i] - sums.0[i];
            let bound =
                max_or_nan(8.0 * f64::EPSILON * max_or_nan(terms, sums.0[i].abs()), COLLOCATION_ROUNDINGS * rounding);
            // Written so that a NaN fails.
            let holds = off.abs() <= bound;
            if !holds {
                return false;
            }
        }
        true
    }

    /// The stages of the last step; in transformed time with `g V` for the velocities.
    pub(crate) fn copy_stages(&self, [v, force]: [&mut [Stages]; 2], [rate, l]: [&mut Stages; 2]) {
        let unweighted = |x: &Stages| Solved::unweighted(x, &self.table.weights, self.table.s);
        if self.transformed {
            for (v, moved) in v.iter_mut().zip(self.vectors.moved()) {
                *v = unweighted(moved);
            }
        } else {
            v.copy_from_slice(self.vectors.v());
        }
        for (to, force) in force.iter_mut().zip(self.vectors.force()) {
            *to = unweighted(force);
        }
        (*rate, *l) = (unweighted(&self.rate), unweighted(&self.l));
    }
}
