//! The increments of the state in a step whose stages have momenta and integrating factors.

use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::numbers::compensated::{CompensatedSum, Unevaluated, add, finite};
use crate::numbers::lanes::{Lanes, branched};
use crate::numbers::registers::{Stages, blocks};
use pulp::Simd;

/// The increments of positions, momenta and action in a step.
pub(crate) struct Increments {
    dq: Vec<Unevaluated>,
    dp: Vec<Unevaluated>,
    dz: Unevaluated,
    /// `1 - rho` at the end of the step, and `sigma_d - 1`.
    pub one_minus_rho: f64,
    pub grow: f64,
}

/// The right-hand sides at the stages, multiplied by the weights: V, `rho L_q`, L and `rho L_z`; and `1 - rho`.
pub(crate) struct RightHandSides<'r> {
    pub moved: &'r [Stages],
    pub force: &'r [Stages],
    pub l: &'r Stages,
    pub rate: &'r Stages,
    pub one_minus_rho: &'r Stages,
}

impl Increments {
    pub fn zeros(n: usize) -> Self {
        let zeros = || vec![Unevaluated::default(); n];
        Increments { dq: zeros(), dp: zeros(), dz: Unevaluated::default(), one_minus_rho: 0.0, grow: 0.0 }
    }

    /// Sums the right-hand sides over the s stages; p is the momentum at the start. The result is
    /// [`Done`](IterationOutcome::Done), or the reason for which the step fails.
    #[inline(always)]
    pub fn sum<S: Simd>(&mut self, of: &RightHandSides<'_>, s: usize, p: &[CompensatedSum]) -> IterationOutcome {
        let (one_minus_rho, dz) = (of.rate.sum::<S>(s), of.l.sum::<S>(s));
        let mut deepest = Lanes::<S>::splat(f64::NEG_INFINITY);
        for r in 0..blocks::<S>(s) {
            deepest = deepest.max(of.one_minus_rho.block::<S>(r));
        }
        let rho = 1.0 - deepest.reduce_max();
        if rho <= 0.0 {
            return IterationOutcome::StageFactor { rho };
        }
        if one_minus_rho >= 1.0 {
            return IterationOutcome::SigmaVanished { sigma: 1.0 / (1.0 - one_minus_rho) };
        }
        // Adding this to 1 would round it if the rate is small.
        let grow = one_minus_rho / (1.0 - one_minus_rho);
        for (dq, moved) in self.dq.iter_mut().zip(of.moved) {
            *dq = Unevaluated { head: moved.sum::<S>(s), tail: 0.0 };
        }
        for (dp, (force, p)) in self.dp.iter_mut().zip(of.force.iter().zip(p)) {
            let pushed = force.sum::<S>(s);
            *dp = Unevaluated { head: pushed, tail: grow * (pushed + p.value) };
        }
        if branched() {
            return IterationOutcome::Branched;
        }
        self.dz = Unevaluated { head: dz, tail: 0.0 };
        (self.one_minus_rho, self.grow) = (one_minus_rho, grow);
        // The maximum over lanes may hide a NaN.
        if finite(&self.dq, &self.dp, self.dz) && one_minus_rho.is_finite() {
            IterationOutcome::Done
        } else {
            IterationOutcome::NonFinite
        }
    }

    /// Adds the increments to a state.
    #[inline(always)]
    pub fn add_to(&self, q: &mut [CompensatedSum], p: &mut [CompensatedSum], z: &mut CompensatedSum) {
        add(q, &self.dq);
        add(p, &self.dp);
        z.add(self.dz);
    }
}
