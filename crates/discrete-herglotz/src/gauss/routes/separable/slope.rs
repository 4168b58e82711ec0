//! The slope of the force: its estimate in the matrix of the iteration, and secant steps between iterations.

use crate::gauss::limits::LONG_RUN;
use crate::gauss::routes::separable::Separable;
use crate::gauss::routes::separable::vectors::Parts;
use crate::gauss::tables::condensed::Preconditioned;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use pulp::Simd;

/// Stores the positions and `rest` of this iteration in `before`. With `ahead` it first takes a secant step, which uses
/// the slope of the force between the last two iterations instead of an evaluation. For one coordinate only: a force of
/// several coordinates has no such slope.
#[inline(always)]
pub(crate) fn store_values<S: Simd>(
    left: &Preconditioned,
    s: usize,
    base: &Stages,
    [x, rest]: [&mut Stages; 2],
    [x_before, rest_before]: &mut [Stages; 2],
    ahead: bool,
) {
    let mut next = Stages::ZERO;
    if ahead {
        left.head.b.apply::<S>(rest, s, &mut next, base);
    }
    // A steeper secant is due to round-off.
    let (most, least) = (Lanes::<S>::splat(left.kappa.abs()), Lanes::<S>::splat(f64::MIN_POSITIVE));
    for r in 0..blocks::<S>(s) {
        let (now, added) = (x.block::<S>(r), rest.block::<S>(r));
        if ahead {
            let (moved, more) = (now - x_before.block(r), added - rest_before.block(r));
            // The slope is zero for stages that have not moved.
            let slope = more * moved / moved.mul_add(moved, least);
            let slope = -(-slope.max(-most)).max(-most);
            rest.set(r, slope.mul_add(next.block::<S>(r) - now, added));
            x.set(r, next.block::<S>(r));
        }
        x_before.set(r, now);
        rest_before.set(r, added);
    }
}

/// The largest absolute value of `rest`.
#[inline(always)]
pub(crate) fn largest<S: Simd>(rest: &[Stages], s: usize) -> f64 {
    let mut largest = Lanes::<S>::splat(0.0);
    for rest in rest {
        for r in 0..blocks::<S>(s) {
            largest = largest.max(rest.block::<S>(r).abs());
        }
    }
    largest.reduce_max()
}

impl Separable {
    /// Estimates the slope of the force, and refines the matrices if they are expected to be kept for long.
    pub(crate) fn update_matrix(&mut self) {
        self.adapt();
        if self.taken >= LONG_RUN {
            self.vectors.parts(self.q.len()).left.refine(&self.table);
        }
    }

    /// Estimates the slope of the force from the stages of the last step by least squares, and computes a new matrix if
    /// the slope has changed enough.
    #[inline(never)]
    fn adapt(&mut self) {
        let s = self.table.s;
        let Parts { left, rest, x, a, .. } = self.vectors.parts(self.q.len());
        let (mut products, mut squares) = (0.0, 0.0);
        for (x, a) in x.iter().zip(a.iter()) {
            let (x, a) = (&x.0[..s], &a.0[..s]);
            let mean = |y: &[f64]| y.iter().sum::<f64>() / s as f64;
            let (mx, ma) = (mean(x), mean(a));
            for (x, a) in x.iter().zip(a) {
                products += (x - mx) * (a - ma);
                squares += (x - mx) * (x - mx);
            }
        }
        let kappa = -products / squares;
        // The longer a matrix is expected to be kept, the smaller the change of slope that justifies a new one.
        let worth = f64::min(0.02, 50.0 / (self.taken * self.taken) as f64);
        if !kappa.is_finite() || (kappa - left.kappa).abs() <= worth * kappa.abs() {
            return;
        }
        if let Some(new) = self.table.preconditioned(kappa) {
            let change = kappa - left.kappa;
            for (rest, x) in rest.iter_mut().zip(x.iter()) {
                rest.0.iter_mut().zip(&x.0).for_each(|(r, x)| *r += change * x);
            }
            *left = new;
        }
    }
}
