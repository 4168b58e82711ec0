//! Eight numbers in vector registers: the scalar type for the evaluation of local terms.

use contact_geom::{Scalar, scalar_operators};
use std::ops::Neg;
use wide::f64x8;

/// The number of lanes: that of the widest vector registers (AVX-512). Narrower ones are used several at a time.
pub(crate) const LANES: usize = 8;

/// The bound of the arguments that `wide` reduces with its three parts of pi/2 without loss. The first two parts have
/// 27 and 23 binary digits fewer than a double, so that their products with up to 2^19 quarter turns are exact.
const MAX_REDUCIBLE_ARGUMENT: f64 = 5e5;

/// Eight numbers that are processed at once, for the same local term of eight elements. The instruction set is that of
/// the build (`target-cpu`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lanes(f64x8);

impl Lanes {
    #[inline(always)]
    pub fn new(x: [f64; LANES]) -> Self {
        Lanes(f64x8::new(x))
    }

    #[inline(always)]
    pub fn splat(x: f64) -> Self {
        Lanes(f64x8::splat(x))
    }

    /// The eight numbers of a slice from the index `at` on; NaN if the slice is too short.
    #[inline(always)]
    pub fn load(x: &[f64], at: usize) -> Self {
        match x.get(at..).and_then(|rest| rest.first_chunk::<LANES>()) {
            Some(chunk) => Self::new(*chunk),
            None => Self::splat(f64::NAN),
        }
    }

    /// Fewer than eight numbers of a slice from the index `at` on; unused lanes repeat the first of them.
    #[inline(always)]
    pub fn load_part(x: &[f64], at: usize, count: usize) -> Self {
        let part = x.get(at..at + count).unwrap_or(&[]);
        let mut all = [part.first().copied().unwrap_or(f64::NAN); LANES];
        for (a, b) in all.iter_mut().zip(part) {
            *a = *b;
        }
        Self::new(all)
    }

    /// `self * b + c`, fused if the build target has the instruction.
    #[inline(always)]
    pub fn mul_add(self, b: Self, c: Self) -> Self {
        Lanes(self.0.mul_add(b.0, c.0))
    }

    #[inline(always)]
    pub fn to_array(self) -> [f64; LANES] {
        self.0.to_array()
    }

    /// Applies a function lane by lane, for functions that are rare in mechanics.
    #[inline]
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        Self::new(self.to_array().map(f))
    }

    /// Whether all lanes are in the range in which the argument reduction of sine and cosine is exact.
    #[inline(always)]
    fn are_reducible(self) -> bool {
        self.0.abs().simd_lt(f64x8::splat(MAX_REDUCIBLE_ARGUMENT)).all()
    }
}

impl From<f64> for Lanes {
    #[inline(always)]
    fn from(x: f64) -> Self {
        Self::splat(x)
    }
}

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Lanes(-self.0)
    }
}

scalar_operators! { [] Lanes;
    a + b = Lanes(a.0 + b.0);
    c - d = Lanes(c.0 - d.0);
    e * f = Lanes(e.0 * f.0);
    g / h = Lanes(g.0 / h.0);
}

impl Scalar for Lanes {
    /// NaN if the lanes differ: a formula that branches on it returns NaN, and the step is refused.
    #[inline(always)]
    fn re(self) -> f64 {
        let lanes = self.to_array();
        if lanes.iter().all(|x| *x == lanes[0]) { lanes[0] } else { f64::NAN }
    }
    fn pivot_size(self) -> f64 {
        self.to_array().iter().fold(f64::INFINITY, |m, x| if x.abs() < m || x.is_nan() { x.abs() } else { m })
    }
    fn extent(self) -> f64 {
        Scalar::extent(self.re())
    }
    #[inline(always)]
    fn if_less(self, than: Self, then: Self, otherwise: Self) -> Self {
        let not_less = self.0.simd_ge(than.0).select(otherwise.0, f64x8::splat(f64::NAN));
        Lanes(self.0.simd_lt(than.0).select(then.0, not_less))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Lanes(self.0.abs())
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Lanes(f64x8::splat(1.0) / self.0)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Lanes(self.0.sqrt())
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
    fn powf(self, a: f64) -> Self {
        self.each(|x| x.powf(a))
    }
    #[inline(always)]
    fn exp(self) -> Self {
        Lanes(self.0.exp())
    }
    fn exp_m1(self) -> Self {
        self.each(f64::exp_m1)
    }
    fn ln(self) -> Self {
        self.each(f64::ln)
    }
    fn ln_1p(self) -> Self {
        self.each(f64::ln_1p)
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        if !self.are_reducible() {
            return (self.each(f64::sin), self.each(f64::cos));
        }
        let (s, c) = self.0.sin_cos();
        (Lanes(s), Lanes(c))
    }
    fn piecewise<const K: usize>(self, of: impl Fn(f64) -> [f64; K] + Copy) -> [Self; K] {
        let found = self.to_array().map(of);
        std::array::from_fn(|k| Self::new(found.map(|values| values[k])))
    }
    fn sinh(self) -> Self {
        self.each(f64::sinh)
    }
    fn cosh(self) -> Self {
        self.each(f64::cosh)
    }
    fn tanh(self) -> Self {
        self.each(f64::tanh)
    }
    fn atan(self) -> Self {
        self.each(f64::atan)
    }
}
