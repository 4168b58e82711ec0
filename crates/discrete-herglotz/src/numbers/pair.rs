//! Several SIMD registers as one scalar.

use crate::numbers::lanes::{Lanes, note_branch};
use crate::numbers::registers::{MAX_STAGES, Stages};
use contact_geom::nalgebra::SVector;
use contact_geom::{Scalar, scalar_operators, vector};
use pulp::Simd;
use std::ops::Neg;

/// The values at the stages in one or more SIMD registers, as one scalar.
pub(crate) trait Registers<S: Simd>: Scalar {
    /// The number of registers.
    const COUNT: usize;
    /// The values of the blocks of stages from the r-th on.
    fn of(x: &Stages, r: usize) -> Self;
    /// The i-th register.
    fn register(&self, i: usize) -> Lanes<S>;
}

/// Two scalars as one. With registers, an interpreted formula is decoded once for both, and the operations of one
/// overlap the latency of the other. Each lane has the same bits as with [`Lanes`].
#[derive(Clone, Copy, Debug)]
#[repr(align(64))] // A register that crosses a cache line is slow to read after it was written.
pub(crate) struct Pair<T>(pub T, pub T);

/// Two registers as one scalar.
pub(crate) type Two<S> = Pair<Lanes<S>>;

/// Four registers as one scalar.
pub(crate) type Four<S> = Pair<Two<S>>;

/// Whether formulas are evaluated over two registers at once: not for registers of a single lane, which have a value to
/// branch on.
pub(crate) const fn by_two<S: Simd>() -> bool {
    S::F64_LANES > 1
}

/// Whether formulas are evaluated over four registers at once: if the stages can fill as many.
pub(crate) const fn by_four<S: Simd>() -> bool {
    by_two::<S>() && 4 * S::F64_LANES <= MAX_STAGES
}

impl<S: Simd> Registers<S> for Lanes<S> {
    const COUNT: usize = 1;
    #[inline(always)]
    fn of(x: &Stages, r: usize) -> Self {
        x.block(r)
    }
    #[inline(always)]
    fn register(&self, _i: usize) -> Lanes<S> {
        *self
    }
}

impl<S: Simd, T: Registers<S>> Registers<S> for Pair<T> {
    const COUNT: usize = 2 * T::COUNT;
    #[inline(always)]
    fn of(x: &Stages, r: usize) -> Self {
        Pair(T::of(x, r), T::of(x, r + T::COUNT))
    }
    #[inline(always)]
    fn register(&self, i: usize) -> Lanes<S> {
        if i < T::COUNT { self.0.register(i) } else { self.1.register(i - T::COUNT) }
    }
}

/// The i-th register of each component of a vector.
#[inline(always)]
pub(crate) fn register<S: Simd, T: Registers<S>, const N: usize>(x: &SVector<T, N>, i: usize) -> SVector<Lanes<S>, N> {
    vector!(|d| x[d].register(i))
}

/// The common value of two numbers; records a branch and returns NaN if they differ.
fn agreed(a: f64, b: f64) -> f64 {
    if a == b || a.is_nan() && b.is_nan() {
        return a;
    }
    note_branch();
    f64::NAN
}

impl<T: PartialEq> PartialEq for Pair<T> {
    fn eq(&self, b: &Self) -> bool {
        let (one, other) = (self.0 == b.0, self.1 == b.1);
        if one != other {
            note_branch();
        }
        one && other
    }
}

impl<T: From<f64>> From<f64> for Pair<T> {
    #[inline(always)]
    fn from(x: f64) -> Self {
        Pair(T::from(x), T::from(x))
    }
}

impl<T: Neg<Output = T>> Neg for Pair<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Pair(-self.0, -self.1)
    }
}

scalar_operators! { [T: Scalar] Pair<T>;
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

impl<T: Scalar> Scalar for Pair<T> {
    functions! { abs recip sqrt exp exp_m1 ln ln_1p sin cos sinh cosh tanh atan }
    fn re(self) -> f64 {
        agreed(self.0.re(), self.1.re())
    }
    fn pivot_size(self) -> f64 {
        let (a, b) = (self.0.pivot_size(), self.1.pivot_size());
        if a <= b || a.is_nan() { a } else { b }
    }
    fn extent(self) -> f64 {
        agreed(self.0.extent(), self.1.extent())
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
    fn piecewise<const K: usize>(self, of: impl Fn(f64) -> [f64; K] + Copy) -> [Self; K] {
        let (a, b) = (self.0.piecewise(of), self.1.piecewise(of));
        let mut both = [Self::from(0.0); K];
        for k in 0..K {
            both[k] = Pair(a[k], b[k]);
        }
        both
    }
    #[inline(always)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        T::apart(work)
    }
}

/// Calls a method over as many registers at once as a formula is decoded for: one if L is compiled, not interpreted.
macro_rules! over_registers {
    ($this:ident.$method:ident($($argument:expr),*); $interpreted:expr, $s:ident, $left:expr) => {{
        use $crate::numbers::{lanes::Lanes, pair};
        let left = $left;
        if const { $interpreted && pair::by_four::<$s>() } && left >= 4 {
            $this.$method::<$s, pair::Four<$s>>($($argument),*)
        } else if const { $interpreted && pair::by_two::<$s>() } && left >= 2 {
            $this.$method::<$s, pair::Two<$s>>($($argument),*)
        } else {
            $this.$method::<$s, Lanes<$s>>($($argument),*)
        }
    }};
}
pub(crate) use over_registers;
