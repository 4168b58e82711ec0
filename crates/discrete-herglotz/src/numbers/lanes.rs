//! The lanes of a SIMD register as a scalar type over which a Lagrangian can be evaluated.

use crate::numbers::functions::{
    EXPONENT_RANGE, REDUCIBLE, Register, cosine, exponential, exponential_minus_one, hyperbolic_sine,
    hyperbolic_tangent, logarithm, power, sine,
};
use contact_geom::{Scalar, scalar_operators};
use pulp::{Simd, WithSimd, bytemuck};
use std::cell::Cell;
use std::fmt::{Debug, Formatter};
use std::ops::Neg;

/// One SIMD register of the instruction set `S`, with one number per lane.
///
/// The instruction set is selected at run time: kernels are generic over `S` and run through `Instructions::dispatch`,
/// so that a default build uses the instructions of the processor. Lanes exist only inside such kernels.
#[derive(Clone, Copy)]
pub(crate) struct Lanes<S: Simd>(pub S::f64s);

/// The token of an instruction set, made without a check of the processor.
#[allow(unsafe_code)] // The trait has no other way to a token; see below for soundness.
#[inline(always)]
pub(crate) fn token<S: Simd>() -> S {
    const { assert!(size_of::<S>() == 0, "a token carries nothing") };
    // SAFETY: a token is a proof, of size 0, that the processor has the instructions. `Lanes<S>` is private to this
    // crate and is made only in kernels run by `Instructions::dispatch`, which holds a token of the same type.
    unsafe { std::mem::zeroed() }
}

thread_local! {
    /// Whether a single value was requested of lanes that differ.
    static ASKED: Cell<bool> = const { Cell::new(false) };
}

/// Whether, since [`forget_branches`], a single value was requested on this thread of lanes that differ, by `re`,
/// `extent` or `==`: a formula has then branched in the same way for all lanes, and its results may be wrong.
#[inline(always)]
pub(crate) fn branched() -> bool {
    ASKED.get()
}

/// Records that a formula has branched.
#[cold]
pub(crate) fn note_branch() {
    ASKED.set(true);
}

/// Resets the record of branches.
#[inline(always)]
pub(crate) fn forget_branches() {
    ASKED.set(false);
}

impl<S: Simd> Lanes<S> {
    /// The number of lanes of a register.
    pub const COUNT: usize = S::F64_LANES;

    #[inline(always)]
    pub fn splat(x: f64) -> Self {
        Lanes(token::<S>().splat_f64s(x))
    }

    /// `self * b + c`, fused if the instruction set has fused multiply-add.
    #[inline(always)]
    pub fn mul_add(self, b: Self, c: Self) -> Self {
        Lanes(token::<S>().mul_add_e_f64s(self.0, b.0, c.0))
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        // The instruction set's own function is a call in some sets.
        let set = token::<S>();
        Lanes(set.and_f64s(self.0, set.splat_f64s(f64::from_bits(u64::MAX >> 1))))
    }

    /// The lane-wise maximum. If one value is NaN, the result may be either of them, unlike that of [`Scalar::max`].
    #[inline(always)]
    pub fn max(self, b: Self) -> Self {
        Lanes(token::<S>().max_f64s(self.0, b.0))
    }

    #[inline(always)]
    pub fn sum(self) -> f64 {
        token::<S>().reduce_sum_f64s(self.0)
    }

    #[inline(always)]
    pub fn reduce_max(self) -> f64 {
        token::<S>().reduce_max_f64s(self.0)
    }

    /// The lanes as a slice.
    #[inline(always)]
    pub fn lanes(&self) -> &[f64] {
        bytemuck::cast_slice(std::slice::from_ref(&self.0))
    }

    /// Applies a function of one number lane by lane, for functions that are rare in mechanics.
    #[inline]
    fn each(mut self, f: impl Fn(f64) -> f64) -> Self {
        for x in bytemuck::cast_slice_mut::<_, f64>(std::slice::from_mut(&mut self.0)) {
            *x = f(*x);
        }
        self
    }

    /// Whether the absolute values of all lanes are below a bound.
    #[inline(always)]
    fn is_below(self, bound: f64) -> bool {
        self.abs().reduce_max() < bound
    }

    /// Whether no lane is below or above the normal numbers of a sign.
    #[inline(always)]
    fn is_positive(self) -> bool {
        let [zero, one] = [0.0, 1.0].map(Self::splat);
        let outside = Self::splat(f64::MAX).where_less(self, one, zero);
        self.where_less(Self::splat(f64::MIN_POSITIVE), one, outside).reduce_max() == 0.0
    }
}

impl<S: Simd> Register for Lanes<S> {
    /// The instruction sets with at least four lanes have fused multiply-add.
    const FUSED: bool = S::F64_LANES >= 4;
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Lanes::splat(x)
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Lanes::mul_add(self, b, c)
    }
    #[inline(always)]
    fn turned(self, of: Self) -> Self {
        let set = token::<S>();
        let last = set.and_u64s(set.transmute_u64s_f64s(of.0), set.splat_u64s(1));
        Lanes(set.select_f64s(set.equal_u64s(last, set.splat_u64s(0)), self.0, (-self).0))
    }
    #[inline(always)]
    fn where_less(self, b: Self, then: Self, otherwise: Self) -> Self {
        let set = token::<S>();
        Lanes(set.select_f64s(set.less_than_f64s(self.0, b.0), then.0, otherwise.0))
    }
    #[inline(always)]
    fn map_digits(mut self, of: impl Fn(u64) -> u64) -> Self {
        for digits in bytemuck::cast_slice_mut::<_, u64>(std::slice::from_mut(&mut self.0)) {
            *digits = of(*digits);
        }
        self
    }
}

impl<S: Simd> Debug for Lanes<S> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        self.lanes().fmt(f)
    }
}

impl<S: Simd> PartialEq for Lanes<S> {
    fn eq(&self, b: &Self) -> bool {
        let (a, b) = (self.lanes(), b.lanes());
        let equal = a.iter().zip(b).filter(|(a, b)| a == b).count();
        if equal != 0 && equal != a.len() {
            ASKED.set(true);
        }
        equal == a.len()
    }
}

impl<S: Simd> From<f64> for Lanes<S> {
    #[inline(always)]
    fn from(x: f64) -> Self {
        Self::splat(x)
    }
}

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        // The instruction set's own function is a call in some sets.
        let set = token::<S>();
        Lanes(set.xor_f64s(self.0, set.splat_f64s(-0.0)))
    }
}

scalar_operators! { [S: Simd] Lanes<S>;
    a + b = Lanes(token::<S>().add_f64s(a.0, b.0));
    c - d = Lanes(token::<S>().sub_f64s(c.0, d.0));
    e * f = Lanes(token::<S>().mul_f64s(e.0, f.0));
    g / h = Lanes(token::<S>().div_f64s(g.0, h.0));
}

impl<S: Simd> Scalar for Lanes<S> {
    #[inline(always)]
    fn re(self) -> f64 {
        let lanes = self.lanes();
        if lanes.iter().all(|x| *x == lanes[0] || (x.is_nan() && lanes[0].is_nan())) {
            return lanes[0];
        }
        ASKED.set(true);
        f64::NAN
    }
    #[inline(always)]
    fn pivot_size(self) -> f64 {
        self.lanes().iter().fold(f64::INFINITY, |m, x| if x.abs() < m || x.is_nan() { x.abs() } else { m })
    }
    #[inline(always)]
    fn extent(self) -> f64 {
        Scalar::extent(self.re())
    }
    #[inline(always)]
    fn if_less(self, than: Self, then: Self, otherwise: Self) -> Self {
        let set = token::<S>();
        let less = set.less_than_f64s(self.0, than.0);
        let not_less = set.less_than_or_equal_f64s(than.0, self.0);
        let unordered = set.splat_f64s(f64::NAN);
        Lanes(set.select_f64s(less, then.0, set.select_f64s(not_less, otherwise.0, unordered)))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Lanes::abs(self)
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Self::splat(1.0) / self
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Lanes(token::<S>().sqrt_f64s(self.0))
    }
    #[inline(always)]
    fn powi(self, n: i32) -> Self {
        let (mut power, mut base, mut left) = (Self::splat(1.0), self, n.unsigned_abs());
        while left > 0 {
            if left % 2 == 1 {
                power *= base;
            }
            base *= base;
            left /= 2;
        }
        if n < 0 { power.recip() } else { power }
    }
    #[inline(always)]
    fn powf(self, a: f64) -> Self {
        let of_each = |x: Self| x.each(|x| x.powf(a));
        if const { !Self::FUSED } || a.fract() == 0.0 {
            return of_each(self);
        }
        let [zero, one] = [0.0, 1.0].map(Self::splat);
        // Powers of 0 are frequent, as of the depth of a contact.
        let is_zero = Lanes::abs(self).where_less(Self::splat(f64::from_bits(1)), one, zero);
        if !(self + is_zero).is_positive() {
            return of_each(self);
        }
        let [value, product] = power(self + is_zero, a);
        if !product.is_below(EXPONENT_RANGE) {
            return of_each(self);
        }
        let at_zero = Self::splat(if a < 0.0 { f64::INFINITY } else { 0.0 });
        zero.where_less(is_zero, at_zero, value)
    }
    #[inline(always)]
    fn exp(self) -> Self {
        if !self.is_below(EXPONENT_RANGE) {
            return self.each(f64::exp);
        }
        exponential(self, Self::splat(0.0))
    }
    #[inline(always)]
    fn exp_m1(self) -> Self {
        if !self.is_below(EXPONENT_RANGE) {
            return self.each(f64::exp_m1);
        }
        exponential_minus_one(self)
    }
    #[inline(always)]
    fn ln(self) -> Self {
        if !self.is_positive() {
            return self.each(f64::ln);
        }
        logarithm(self)
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
        if !self.is_below(REDUCIBLE) {
            return self.each(f64::sin);
        }
        sine(self)
    }
    #[inline(always)]
    fn cos(self) -> Self {
        if !self.is_below(REDUCIBLE) {
            return self.each(f64::cos);
        }
        cosine(self)
    }
    #[inline(always)]
    fn sin_versine(self) -> (Self, Self) {
        let half = Scalar::sin(self * 0.5);
        (Scalar::sin(self), half * half * 2.0)
    }
    #[inline(always)]
    fn sinh(self) -> Self {
        if !self.is_below(EXPONENT_RANGE) {
            return self.each(f64::sinh);
        }
        hyperbolic_sine(self)
    }
    #[inline(always)]
    fn cosh(self) -> Self {
        if !self.is_below(EXPONENT_RANGE) {
            return self.each(f64::cosh);
        }
        let e = exponential(self, Self::splat(0.0));
        (e + Scalar::recip(e)) * 0.5
    }
    #[inline(always)]
    fn tanh(self) -> Self {
        hyperbolic_tangent(self)
    }
    fn atan(self) -> Self {
        self.each(f64::atan)
    }
    fn piecewise<const K: usize>(self, of: impl Fn(f64) -> [f64; K] + Copy) -> [Self; K] {
        let mut found = [Self::splat(0.0); K];
        for (i, x) in self.lanes().iter().enumerate() {
            for (to, value) in found.iter_mut().zip(of(*x)) {
                bytemuck::cast_slice_mut::<_, f64>(std::slice::from_mut(&mut to.0))[i] = value;
            }
        }
        found
    }
    #[inline(never)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        struct Work<F>(F);
        impl<R, F: FnOnce() -> R> WithSimd for Work<F> {
            type Output = R;
            #[inline(always)]
            fn with_simd<S: Simd>(self, _simd: S) -> R {
                (self.0)()
            }
        }
        token::<S>().vectorize(Work(work))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_geom::nalgebra::SVector;

    /// Evaluates [`choices`] for pairs of numbers in SIMD lanes.
    struct ChooseLanes<'a>(&'a [f64], &'a [f64]);

    /// `if_less` of a, b and 10, 20; the maximum and minimum of a and b; the absolute value and the sign of a, and the
    /// integer below it.
    fn choices<T: Scalar>(a: T, b: T) -> [T; 6] {
        let [_, floor] = a.piecewise(|a| [0.0, a.floor()]);
        [
            a.if_less(b, 10.0.into(), 20.0.into()),
            Scalar::max(a, b),
            Scalar::min(a, b),
            Scalar::abs(a),
            a.signum(),
            floor,
        ]
    }

    impl WithSimd for ChooseLanes<'_> {
        type Output = Vec<[f64; 6]>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
            let (mut out, n) = (Vec::new(), Lanes::<S>::COUNT);
            for (a, b) in self.0.chunks_exact(n).zip(self.1.chunks_exact(n)) {
                let chosen = choices(Lanes::<S>(S::as_simd_f64s(a).0[0]), Lanes::<S>(S::as_simd_f64s(b).0[0]));
                out.extend((0..n).map(|i| chosen.map(|x| x.lanes()[i])));
            }
            out
        }
    }

    #[test]
    fn choices_are_those_of_one_number() {
        let values = [0.0, -0.0, 1.0, -1.0, 2.5, f64::INFINITY, f64::NEG_INFINITY, f64::NAN];
        let pairs = values.iter().flat_map(|a| values.iter().map(move |b| (*a, *b)));
        let (a, b): (Vec<_>, Vec<_>) = pairs.unzip();
        let mut sets = vec![pulp::Scalar::new().vectorize(ChooseLanes(&a, &b))];
        #[cfg(target_arch = "x86_64")]
        {
            sets.extend(pulp::x86::V3::try_new().map(|set| Simd::vectorize(set, ChooseLanes(&a, &b))));
            sets.extend(pulp::x86::V4::try_new().map(|set| Simd::vectorize(set, ChooseLanes(&a, &b))));
        }
        for set in sets {
            assert_eq!(set.len(), a.len());
            for ((a, b), found) in a.iter().zip(&b).zip(set) {
                let expected = choices(*a, *b);
                let same = found.iter().zip(&expected).all(|(x, y)| x == y || (x.is_nan() && y.is_nan()));
                assert!(same, "{a}, {b}: {found:?}, not {expected:?}");
                assert!(!(a.is_nan() || b.is_nan()) || found[..3].iter().all(|x| x.is_nan()));
            }
        }
    }

    /// Evaluates [`slopes`] of numbers in SIMD lanes.
    struct Powers<'a>(&'a [f64]);

    /// The derivatives of powers of x, and of a case distinction by x.
    fn slopes<T: Scalar>(x: T) -> [T; 5] {
        let x = contact_geom::support::KernelDual { re: x, d: SVector::<T, 1>::new(T::one()) };
        let zero = num_traits::Zero::zero();
        let chosen = x.if_less(zero, zero, x.powf(2.5) + x.sqrt());
        [Scalar::abs(x).powf(2.5), (x * x).powf(1.5), (x * x).powf(0.5), x.sqrt(), chosen].map(|y| y.d[0])
    }

    impl WithSimd for Powers<'_> {
        type Output = Vec<[f64; 5]>;

        #[inline(always)]
        fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
            let mut out = Vec::new();
            for x in self.0.chunks_exact(Lanes::<S>::COUNT) {
                let found = slopes(Lanes::<S>(S::as_simd_f64s(x).0[0]));
                out.extend((0..x.len()).map(|i| found.map(|y| y.lanes()[i])));
            }
            out
        }
    }

    #[test]
    fn slopes_of_powers_are_those_of_one_number() {
        let x = [0.0, 1.0, -0.0, -2.0, 1e-9, f64::NAN, f64::INFINITY, 0.3];
        let mut sets = vec![pulp::Scalar::new().vectorize(Powers(&x))];
        #[cfg(target_arch = "x86_64")]
        {
            sets.extend(pulp::x86::V3::try_new().map(|set| Simd::vectorize(set, Powers(&x))));
            sets.extend(pulp::x86::V4::try_new().map(|set| Simd::vectorize(set, Powers(&x))));
        }
        assert_eq!(slopes(0.0), [0.0, 0.0, 0.0, f64::INFINITY, f64::INFINITY]);
        assert_eq!(slopes(-2.0)[4], 0.0);
        for set in sets {
            for (x, found) in x.iter().zip(set) {
                let expected = slopes(*x);
                let same = found.iter().zip(&expected).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()));
                assert!(same, "{x}: {found:?}, not {expected:?}");
            }
        }
    }

    /// Requests a single value of lanes that hold two numbers, in each of the possible ways.
    struct Ask(f64, f64);

    impl WithSimd for Ask {
        type Output = [bool; 4];

        #[inline(always)]
        fn with_simd<S: Simd>(self, _simd: S) -> Self::Output {
            let mut x = Lanes::<S>::splat(self.0);
            bytemuck::cast_slice_mut::<_, f64>(std::slice::from_mut(&mut x.0))[0] = self.1;
            let zero = <Lanes<S> as num_traits::Zero>::zero();
            let asked = |ask: &dyn Fn() -> bool| {
                forget_branches();
                ask();
                branched()
            };
            [
                asked(&|| x.re() > 0.0),
                asked(&|| x.extent() > 0.0),
                asked(&|| x == zero),
                asked(&|| num_traits::Zero::is_zero(&x)),
            ]
        }
    }

    #[test]
    fn one_value_of_lanes_that_differ_is_noticed() {
        assert_eq!(pulp::Scalar::new().vectorize(Ask(0.0, 1.0)), [false; 4]);
        for (a, b) in [(1.0, 1.0), (0.0, -0.0), (f64::NAN, f64::NAN)] {
            assert_eq!(pulp::Arch::new().dispatch(Ask(a, b)), [false; 4], "{a}, {b}");
        }
        if !matches!(pulp::Arch::new(), pulp::Arch::Scalar) {
            assert_eq!(pulp::Arch::new().dispatch(Ask(0.0, 1.0)), [true; 4]);
            assert_eq!(pulp::Arch::new().dispatch(Ask(f64::NAN, 0.0)), [true; 4]);
        }
        forget_branches();
    }
}
