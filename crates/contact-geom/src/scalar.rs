//! The numbers that a Lagrangian is written over.

use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign};
use num_traits::{One, Zero};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number that smooth formulas are written over: `f64`, a [`Dual`](crate::Dual) of any depth, or lanes of a vector
/// register.
///
/// A Lagrangian, a Hamiltonian, a map or a group action is one function, generic over `T: Scalar`; its derivatives are
/// that same function evaluated on duals. The trait holds arithmetic (with another `Self` and with `f64`), the elementary
/// functions, and nothing that could branch on a value: a formula that branches is not smooth.
///
/// ```
/// use contact_geom::Scalar;
/// fn potential<T: Scalar>(q: T) -> T { -q.cos() + 1.0 }
/// assert_eq!(potential(0.0), 0.0);
/// ```
pub trait Scalar:
    nalgebra::Scalar
    + Copy
    + Zero
    + One
    + From<f64>
    + Neg<Output = Self>
    + ClosedAddAssign
    + ClosedSubAssign
    + ClosedMulAssign
    + ClosedDivAssign
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// The value without its differentials. For lanes: of the first; only a guess that is improved upon may depend on it.
    fn re(self) -> f64;
    /// The size of the value without its differentials, used only to choose pivots and to see that a number is finite.
    /// For lanes: of the lane that matters most to a pivot, the smallest.
    #[inline(always)]
    fn modulus(self) -> f64 {
        self.re().abs()
    }
    /// The largest absolute value among the value and all its differentials: what an iteration or an error control over
    /// this scalar has to make small. A NaN anywhere makes it infinite.
    fn extent(self) -> f64;
    /// `1 / x`.
    fn recip(self) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// The power `x^n` for an integer `n`.
    fn powi(self, n: i32) -> Self;
    /// The power `x^a` for a real `a`, `x > 0`.
    fn powf(self, a: f64) -> Self;
    /// `e^x`.
    fn exp(self) -> Self;
    /// `e^x - 1`, without cancellation near 0.
    fn exp_m1(self) -> Self;
    /// The natural logarithm.
    fn ln(self) -> Self;
    /// `ln(1 + x)`, without cancellation near 0.
    fn ln_1p(self) -> Self;
    /// Sine and cosine together, which costs hardly more than one of them.
    fn sin_cos(self) -> (Self, Self);
    /// The sine.
    #[inline(always)]
    fn sin(self) -> Self {
        self.sin_cos().0
    }
    /// The cosine.
    #[inline(always)]
    fn cos(self) -> Self {
        self.sin_cos().1
    }
    /// Sine and versine `1 - cos x` together, the latter without cancellation near 0: both through the half angle.
    #[inline(always)]
    fn sin_versine(self) -> (Self, Self) {
        let (s, c) = (self * 0.5).sin_cos();
        let twice = s * 2.0;
        (twice * c, twice * s)
    }
    /// The versine `1 - cos x`, the height of a pendulum above its lowest point.
    #[inline(always)]
    fn versine(self) -> Self {
        self.sin_versine().1
    }
    /// The tangent.
    #[inline(always)]
    fn tan(self) -> Self {
        let (s, c) = self.sin_cos();
        s / c
    }
    /// The hyperbolic sine.
    fn sinh(self) -> Self;
    /// The hyperbolic cosine.
    fn cosh(self) -> Self;
    /// The hyperbolic tangent.
    fn tanh(self) -> Self;
    /// The arc tangent.
    fn atan(self) -> Self;
}

impl Scalar for f64 {
    #[inline]
    fn re(self) -> f64 {
        self
    }
    #[inline]
    fn extent(self) -> f64 {
        if self.is_nan() { f64::INFINITY } else { self.abs() }
    }
    #[inline]
    fn recip(self) -> Self {
        1.0 / self
    }
    #[inline]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline]
    fn powi(self, n: i32) -> Self {
        f64::powi(self, n)
    }
    #[inline]
    fn powf(self, a: f64) -> Self {
        f64::powf(self, a)
    }
    #[inline]
    fn exp(self) -> Self {
        f64::exp(self)
    }
    #[inline]
    fn exp_m1(self) -> Self {
        f64::exp_m1(self)
    }
    #[inline]
    fn ln(self) -> Self {
        f64::ln(self)
    }
    #[inline]
    fn ln_1p(self) -> Self {
        f64::ln_1p(self)
    }
    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        f64::sin_cos(self)
    }
    /// Two calls with nothing shared: where one of the results is not used, as the versine in a force, its call is dropped.
    #[inline(always)]
    fn sin_versine(self) -> (Self, Self) {
        let half = f64::sin(0.5 * self);
        (f64::sin(self), 2.0 * half * half)
    }
    #[inline]
    fn sin(self) -> Self {
        f64::sin(self)
    }
    #[inline]
    fn cos(self) -> Self {
        f64::cos(self)
    }
    #[inline]
    fn tan(self) -> Self {
        f64::tan(self)
    }
    #[inline]
    fn sinh(self) -> Self {
        f64::sinh(self)
    }
    #[inline]
    fn cosh(self) -> Self {
        f64::cosh(self)
    }
    #[inline]
    fn tanh(self) -> Self {
        f64::tanh(self)
    }
    #[inline]
    fn atan(self) -> Self {
        f64::atan(self)
    }
}
