//! Several SIMD registers as one scalar, with one trajectory per lane.

use crate::numbers::functions::{
    EXPONENT_RANGE, REDUCIBLE, Register, cosine, exponential, exponential_minus_one, hyperbolic_sine,
    hyperbolic_tangent, logarithm, power, sine,
};
use crate::numbers::lanes::{Lanes, note_branch, token};
use contact_geom::{Scalar, scalar_operators};
use pulp::{Simd, bytemuck};
use std::fmt::{Debug, Formatter};
use std::ops::Neg;

/// `K` registers of the instruction set `S`; the operations of one overlap the latency of the others.
///
/// The bits of a lane depend on that lane alone, and are the same in all instruction sets, since the same products are
/// fused in all of them. A formula that requests a single value of the lanes (`re`, `extent`, `==`) gets NaN or `false`
/// and is recorded as a branch, whether the lanes agree or not: see [`branched`](crate::numbers::lanes::branched).
#[derive(Clone, Copy)]
#[repr(align(64))] // A register that crosses a cache line is slow to read after it was written.
pub(crate) struct SimdBatch<S: Simd, const K: usize>(pub [S::f64s; K]);

/// The registers from a function of their index, for [`registers`](macro@registers).
#[inline(always)]
fn registers_of<S: Simd, const K: usize>(of: impl Fn(usize) -> S::f64s) -> SimdBatch<S, K> {
    let mut x = [token::<S>().splat_f64s(0.0); K];
    for (k, x) in x.iter_mut().enumerate() {
        *x = of(k);
    }
    SimdBatch(x)
}

/// The registers `|k| ...`. The closure is always inlined, which those of `std::array::from_fn` and `map` are not.
macro_rules! registers {
    (|$k:pat_param| $of:expr) => {
        registers_of(
            #[inline(always)]
            |$k| $of,
        )
    };
}

impl<S: Simd, const K: usize> SimdBatch<S, K> {
    /// The number of lanes of all registers.
    pub const COUNT: usize = S::F64_LANES * K;

    #[inline(always)]
    pub fn splat(x: f64) -> Self {
        SimdBatch([token::<S>().splat_f64s(x); K])
    }

    /// The lanes from a function of their index.
    #[inline(always)]
    pub fn from_lanes(mut f: impl FnMut(usize) -> f64) -> Self {
        let mut pack = Self::splat(0.0);
        for (i, x) in pack.lanes_mut().iter_mut().enumerate() {
            *x = f(i);
        }
        pack
    }

    #[inline(always)]
    pub fn lanes(&self) -> &[f64] {
        bytemuck::cast_slice(&self.0)
    }

    #[inline(always)]
    fn lanes_mut(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut(&mut self.0)
    }

    /// `self b + c` with one rounding, in all instruction sets.
    #[inline(always)]
    pub fn mul_add(self, b: Self, c: Self) -> Self {
        let set = token::<S>();
        registers!(|k| set.mul_add_f64s(self.0[k], b.0[k], c.0[k]))
    }

    /// Applies a function of one number lane by lane.
    #[inline]
    fn each(mut self, f: impl Fn(f64) -> f64) -> Self {
        self.lanes_mut().iter_mut().for_each(|x| *x = f(*x));
        self
    }

    /// `then` in the lanes with `self <= b`, `otherwise` in all others, including those with a NaN.
    #[inline(always)]
    pub fn at_most(self, b: Self, then: Self, otherwise: Self) -> Self {
        let set = token::<S>();
        registers!(|k| { set.select_f64s(set.less_than_or_equal_f64s(self.0[k], b.0[k]), then.0[k], otherwise.0[k]) })
    }

    /// The lane-wise maximum. If one value is NaN, the result may be either of them.
    #[inline(always)]
    pub fn max(self, b: Self) -> Self {
        let set = token::<S>();
        registers!(|k| set.max_f64s(self.0[k], b.0[k]))
    }

    /// Whether any lane is not 0.
    #[inline(always)]
    pub fn any(self) -> bool {
        self.lanes().iter().any(|x| *x != 0.0)
    }

    /// The value of a function whose argument has an absolute value below a bound; NaN for other arguments.
    ///
    /// A trajectory with such an argument leaves the batch and is computed by itself. A branch to the function of the
    /// standard library would force all registers to memory.
    #[inline(always)]
    fn within(self, argument: Self, bound: f64) -> Self {
        Scalar::abs(argument).where_less(Self::splat(bound), self, Self::splat(f64::NAN))
    }

    /// The value of a function whose argument is a positive normal number; NaN for other arguments.
    #[inline(always)]
    fn of_positive(self, argument: Self) -> Self {
        let none = Self::splat(f64::NAN);
        Self::splat(f64::MIN_POSITIVE.next_down()).where_less(argument, self, none)
    }
}

impl<S: Simd, const K: usize> Register for SimdBatch<S, K> {
    const FUSED: bool = true;
    #[inline(always)]
    fn splat(x: f64) -> Self {
        SimdBatch::splat(x)
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        SimdBatch::mul_add(self, b, c)
    }
    #[inline(always)]
    fn turned(self, of: Self) -> Self {
        registers!(|k| Lanes::<S>(self.0[k]).turned(Lanes(of.0[k])).0)
    }
    #[inline(always)]
    fn where_less(self, b: Self, then: Self, otherwise: Self) -> Self {
        registers!(|k| Lanes::<S>(self.0[k]).where_less(Lanes(b.0[k]), Lanes(then.0[k]), Lanes(otherwise.0[k])).0)
    }
    #[inline(always)]
    fn map_digits(self, of: impl Fn(u64) -> u64) -> Self {
        registers!(|k| Lanes::<S>(self.0[k]).map_digits(&of).0)
    }
}

impl<S: Simd, const K: usize> Debug for SimdBatch<S, K> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        self.lanes().fmt(f)
    }
}

impl<S: Simd, const K: usize> PartialEq for SimdBatch<S, K> {
    fn eq(&self, _: &Self) -> bool {
        note_branch();
        false
    }
}

impl<S: Simd, const K: usize> From<f64> for SimdBatch<S, K> {
    #[inline(always)]
    fn from(x: f64) -> Self {
        Self::splat(x)
    }
}

impl<S: Simd, const K: usize> Neg for SimdBatch<S, K> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        registers!(|k| token::<S>().neg_f64s(self.0[k]))
    }
}

scalar_operators! { [S: Simd, const K: usize] SimdBatch<S, K>;
    a + b = registers!(|k| token::<S>().add_f64s(a.0[k], b.0[k]));
    c - d = registers!(|k| token::<S>().sub_f64s(c.0[k], d.0[k]));
    e * f = registers!(|k| token::<S>().mul_f64s(e.0[k], f.0[k]));
    g / h = registers!(|k| token::<S>().div_f64s(g.0[k], h.0[k]));
}

impl<S: Simd, const K: usize> Scalar for SimdBatch<S, K> {
    fn re(self) -> f64 {
        note_branch();
        f64::NAN
    }
    fn pivot_size(self) -> f64 {
        self.re()
    }
    fn extent(self) -> f64 {
        self.re()
    }
    #[inline(always)]
    fn if_less(self, than: Self, then: Self, otherwise: Self) -> Self {
        let set = token::<S>();
        let unordered = set.splat_f64s(f64::NAN);
        registers!(|k| {
            let less = set.less_than_f64s(self.0[k], than.0[k]);
            let not_less = set.less_than_or_equal_f64s(than.0[k], self.0[k]);
            set.select_f64s(less, then.0[k], set.select_f64s(not_less, otherwise.0[k], unordered))
        })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        registers!(|k| Lanes::<S>(self.0[k]).abs().0)
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Self::splat(1.0) / self
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        registers!(|k| token::<S>().sqrt_f64s(self.0[k]))
    }
    /// The products of `f64::powi`, in the same order.
    #[inline(always)]
    fn powi(self, n: i32) -> Self {
        let (mut power, mut base, mut left) = (Self::splat(1.0), self, n.unsigned_abs());
        while left > 0 {
            if left % 2 == 1 {
                power *= base;
            }
            left /= 2;
            if left > 0 {
                base *= base;
            }
        }
        if n < 0 { power.recip() } else { power }
    }
    #[inline(always)]
    fn powf(self, a: f64) -> Self {
        if a.fract() == 0.0 {
            return self.each(|x| x.powf(a));
        }
        let [value, product] = power(self, a);
        let value = value.within(product, EXPONENT_RANGE).of_positive(self);
        // Powers of 0 are frequent, as of the depth of a contact.
        let at_zero = Self::splat(if a < 0.0 { f64::INFINITY } else { 0.0 });
        Scalar::abs(self).where_less(Self::splat(f64::from_bits(1)), at_zero, value)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        exponential(self, Self::splat(0.0)).within(self, EXPONENT_RANGE)
    }
    #[inline(always)]
    fn exp_m1(self) -> Self {
        exponential_minus_one(self).within(self, EXPONENT_RANGE)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        logarithm(self).of_positive(self)
    }
    fn ln_1p(self) -> Self {
        self.each(f64::ln_1p)
    }
    /// Two separate polynomials, so that the compiler removes one if its result is not used.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        (Scalar::sin(self), Scalar::cos(self))
    }
    #[inline(always)]
    fn sin(self) -> Self {
        sine(self).within(self, REDUCIBLE)
    }
    #[inline(always)]
    fn cos(self) -> Self {
        cosine(self).within(self, REDUCIBLE)
    }
    #[inline(always)]
    fn sin_versine(self) -> (Self, Self) {
        let half = Scalar::sin(self * 0.5);
        (Scalar::sin(self), half * half * 2.0)
    }
    #[inline(always)]
    fn sinh(self) -> Self {
        hyperbolic_sine(self).within(self, EXPONENT_RANGE)
    }
    #[inline(always)]
    fn cosh(self) -> Self {
        let e = exponential(self, Self::splat(0.0));
        ((e + e.recip()) * 0.5).within(self, EXPONENT_RANGE)
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        hyperbolic_tangent(self)
    }
    fn atan(self) -> Self {
        self.each(f64::atan)
    }
    fn piecewise<const M: usize>(self, of: impl Fn(f64) -> [f64; M] + Copy) -> [Self; M] {
        let mut found = [Self::splat(0.0); M];
        for (i, x) in self.lanes().iter().enumerate() {
            for (to, value) in found.iter_mut().zip(of(*x)) {
                to.lanes_mut()[i] = value;
            }
        }
        found
    }
    #[inline(always)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        Lanes::<S>::apart(work)
    }
}
