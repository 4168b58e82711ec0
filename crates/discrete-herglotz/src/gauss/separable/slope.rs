//! The slope of the force: in the matrix of the sweeps, and along a secant between them.

use super::SeparableStages;
use crate::gauss::lanes::Lanes;
use crate::gauss::stages::{Stages, blocks};
use contact_geom::Lagrangian;
use pulp::Simd;

/// The steps after which a matrix is expected to last.
const LASTING: usize = 64;

impl<L: Lagrangian<N>, const N: usize> SeparableStages<'_, L, N> {
    /// Notes the positions and what the force adds there; with a sweep `ahead` that evaluates no force, but goes along the secant through
    /// those of the last two sweeps. Of one coordinate alone: a force of several has no such slope.
    #[inline(always)]
    pub(super) fn sweep_ahead<S: Simd>(&mut self, [x, rest]: &mut [Stages; 2], ahead: bool) {
        let (s, base) = (self.table.s, &self.base[0]);
        let mut next = Stages::ZERO;
        if ahead {
            self.left.head.b.apply(&self.rest[0], s, &mut next, |r| base.block::<S>(r));
        }
        // What is steeper comes of round-off.
        let (most, least) = (Lanes::<S>::splat(self.left.kappa.abs()), Lanes::<S>::splat(f64::MIN_POSITIVE));
        for r in 0..blocks::<S>(s) {
            let (now, added) = (self.x[0].block::<S>(r), self.rest[0].block::<S>(r));
            if ahead {
                let (moved, more) = (now - x.block(r), added - rest.block(r));
                // Where nothing has moved the slope is zero.
                let slope = more * moved / moved.mul_add(moved, least);
                let slope = -(-slope.max(-most)).max(-most);
                self.rest[0].set(r, slope.mul_add(next.block::<S>(r) - now, added));
            }
            x.set(r, now);
            rest.set(r, added);
        }
    }

    /// The largest of what the force adds to the linear one.
    #[inline(always)]
    pub(super) fn largest_rest<S: Simd>(&self) -> f64 {
        let mut largest = Lanes::<S>::splat(0.0);
        for rest in &self.rest {
            for r in 0..blocks::<S>(self.table.s) {
                largest = largest.max(rest.block::<S>(r).abs());
            }
        }
        largest.largest()
    }

    /// Looks at the slope of the force, and refines matrices that last.
    pub(super) fn look_again(&mut self) {
        self.adapt();
        if self.taken >= LASTING {
            self.left.refine(&self.table);
        }
    }

    /// Takes the slope of the force anew from the stages of the last step, by least squares, where it has changed enough to
    /// be worth a new matrix.
    #[inline(never)]
    fn adapt(&mut self) {
        let s = self.table.s;
        let (mut products, mut squares) = (0.0, 0.0);
        for d in 0..N {
            let (x, a) = (&self.x[d].0[..s], &self.a[d].0[..s]);
            let mean = |y: &[f64]| y.iter().sum::<f64>() / s as f64;
            let (mx, ma) = (mean(x), mean(a));
            for (x, a) in x.iter().zip(a) {
                products += (x - mx) * (a - ma);
                squares += (x - mx) * (x - mx);
            }
        }
        let kappa = -products / squares;
        // The longer a matrix is expected to last, the smaller a change is worth it.
        let worth = f64::min(0.02, 50.0 / (self.taken * self.taken) as f64);
        if !kappa.is_finite() || (kappa - self.left.kappa).abs() <= worth * kappa.abs() {
            return;
        }
        if let Some(left) = self.table.preconditioned(kappa) {
            let change = kappa - self.left.kappa;
            for (rest, x) in self.rest.iter_mut().zip(&self.x) {
                rest.0.iter_mut().zip(&x.0).for_each(|(r, x)| *r += change * x);
            }
            self.left = left;
        }
    }
}
