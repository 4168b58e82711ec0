//! Two registers as one number.

use super::lanes::{Lanes, note_branch};
use super::stages::Stages;
use contact_geom::{Scalar, scalar_operators};
use pulp::Simd;
use std::ops::Neg;

/// The lanes of two registers: a formula that is read instruction by instruction is read once for both, and while one of them waits for its last
/// operation, the other keeps the processor busy. Lane by lane the same bits as [`Lanes`].
#[derive(Clone, Copy, Debug)]
#[repr(align(64))] // Registers that lie across cache lines are slow to read after they were written.
pub(crate) struct Pair<S: Simd>(pub Lanes<S>, pub Lanes<S>);

impl<S: Simd> Pair<S> {
    /// How many pairs there are among so many registers: none of single lanes, which have a value to branch on.
    #[inline(always)]
    pub fn among(registers: usize) -> usize {
        if Lanes::<S>::COUNT > 1 { registers / 2 } else { 0 }
    }

    /// The values of this block of stages and the next.
    #[inline(always)]
    pub fn of(x: &Stages, r: usize) -> Self {
        Pair(x.block(r), x.block(r + 1))
    }

    /// What both say, where it is the same.
    #[inline(always)]
    fn agreed(a: f64, b: f64) -> f64 {
        if a == b || a.is_nan() && b.is_nan() {
            return a;
        }
        note_branch();
        f64::NAN
    }
}

impl<S: Simd> PartialEq for Pair<S> {
    fn eq(&self, b: &Self) -> bool {
        let (one, other) = (self.0 == b.0, self.1 == b.1);
        if one != other {
            note_branch();
        }
        one && other
    }
}

impl<S: Simd> From<f64> for Pair<S> {
    #[inline(always)]
    fn from(x: f64) -> Self {
        Pair(Lanes::splat(x), Lanes::splat(x))
    }
}

impl<S: Simd> Neg for Pair<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Pair(-self.0, -self.1)
    }
}

scalar_operators! { [S: Simd] Pair<S>;
    a + b = Pair(a.0 + b.0, a.1 + b.1);
    c - d = Pair(c.0 - d.0, c.1 - d.1);
    e * f = Pair(e.0 * f.0, e.1 * f.1);
    g / h = Pair(g.0 / h.0, g.1 / h.1);
}

macro_rules! functions {
    ($($name:ident)*) => {$(
        #[inline(always)]
        fn $name(self) -> Self {
            Pair(Scalar::$name(self.0), Scalar::$name(self.1))
        }
    )*};
}

impl<S: Simd> Scalar for Pair<S> {
    functions! { abs recip sqrt exp exp_m1 ln ln_1p sin cos sinh cosh tanh atan }
    fn re(self) -> f64 {
        Self::agreed(self.0.re(), self.1.re())
    }
    fn pivot_size(self) -> f64 {
        let (a, b) = (self.0.pivot_size(), self.1.pivot_size());
        if a <= b || a.is_nan() { a } else { b }
    }
    fn extent(self) -> f64 {
        Self::agreed(self.0.extent(), self.1.extent())
    }
    #[inline(always)]
    fn if_less(self, than: Self, then: Self, otherwise: Self) -> Self {
        Pair(self.0.if_less(than.0, then.0, otherwise.0), self.1.if_less(than.1, then.1, otherwise.1))
    }
    #[inline(always)]
    fn powi(self, n: i32) -> Self {
        Pair(self.0.powi(n), self.1.powi(n))
    }
    fn powf(self, a: f64) -> Self {
        Pair(self.0.powf(a), self.1.powf(a))
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        (Scalar::sin(self), Scalar::cos(self))
    }
    #[inline(always)]
    fn sin_versine(self) -> (Self, Self) {
        let ((s, c), (t, d)) = (self.0.sin_versine(), self.1.sin_versine());
        (Pair(s, t), Pair(c, d))
    }
    #[inline(always)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        Lanes::<S>::apart(work)
    }
}
