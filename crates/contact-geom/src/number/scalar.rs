//! The number types over which a Lagrangian is written.

use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign};
use num_traits::{One, Zero};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number type for smooth formulas: `f64`, a [`Dual`](crate::Dual) of any depth, or the lanes of a SIMD register.
///
/// A Lagrangian, a Hamiltonian, a map or a group action is one function, generic over `T: Scalar`; its derivatives are
/// that same function evaluated on duals. The trait provides arithmetic (with another `Self` and with `f64`), the
/// elementary functions, and comparisons that select a value.
///
/// A formula must not branch on a number by `if`: it may be evaluated for several states at once, in the lanes of a
/// SIMD register, for which the comparison has different results. [`if_less`](Self::if_less), [`abs`](Self::abs),
/// [`max`](Self::max) and similar functions select lane by lane; both values are computed, and one is selected with its
/// differentials. If a formula requests a single value of lanes that differ, by [`re`](Self::re),
/// [`extent`](Self::extent), `==` or `is_zero`, the step is not taken in lanes. Integrators attain their order only
/// where L is smooth along a step.
///
/// ```
/// use contact_geom::Scalar;
/// fn potential<T: Scalar>(q: T) -> T { -q.cos() + 1.0 }
/// assert_eq!(potential(0.0), 0.0);
/// /// A spring that only pushes, `q < 0`.
/// fn one_sided<T: Scalar>(q: T) -> T { q.if_less(T::zero(), q * q * 0.5, T::zero()) }
/// assert_eq!([one_sided(-2.0), one_sided(2.0)], [2.0, 0.0]);
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
    /// The value without its differentials, for uses outside of formulas: initial guesses, domains, messages. For SIMD
    /// lanes that differ there is no such value: the result is NaN, and the integrator refuses the step.
    fn re(self) -> f64;
    /// The absolute value without its differentials, used only to choose pivots and to check that a number is finite.
    /// For lanes it is that of the lane that is critical for a pivot, the smallest.
    #[inline(always)]
    fn pivot_size(self) -> f64 {
        self.re().abs()
    }
    /// The largest absolute value among the value and all its differentials, for the convergence tests of iterations
    /// and for error control over this scalar. It is infinite if any of them is NaN.
    fn extent(self) -> f64;
    /// `then` where this number is less than another, `otherwise` where it is not, each with its differentials; NaN
    /// where one of the two compared numbers is NaN. Equal numbers give `otherwise`.
    fn if_less(self, than: Self, then: Self, otherwise: Self) -> Self;
    /// The larger of two numbers; NaN where one of them is NaN. For equal numbers this one, with its differentials.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.if_less(other, other, self)
    }
    /// The smaller of two numbers; NaN where one of them is NaN. For equal numbers this one, with its differentials.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        other.if_less(self, other, self)
    }
    /// The absolute value. Its derivative is [`signum`](Self::signum), hence 0 at 0.
    fn abs(self) -> Self;
    /// The sign, 1, -1 or 0; it is 0 for both zeros. Its derivative is 0 everywhere.
    #[inline(always)]
    fn signum(self) -> Self {
        let zero = Self::zero();
        self.if_less(zero, -Self::one(), zero.if_less(self, Self::one(), zero))
    }
    /// `1 / x`.
    fn recip(self) -> Self;
    /// The square root. At 0 its slope is infinite; a differential of 0 stays 0.
    fn sqrt(self) -> Self;
    /// The power `x^n` for an integer `n`.
    fn powi(self, n: i32) -> Self;
    /// The power `x^a` for a real `a` and `x > 0`, and for `x = 0` where `a` is not negative, with its derivatives from
    /// the right.
    fn powf(self, a: f64) -> Self;
    /// A differential times a slope that may be infinite, as that of a root at 0. There a differential of 0 stays 0, as
    /// for a constant and for `(q.q)^1.5`; the product is NaN where one of the two is NaN.
    #[inline(always)]
    fn along_slope(self, slope: Self) -> Self {
        let (zero, infinite) = (Self::zero(), Self::from(f64::INFINITY));
        let at_zero = Scalar::abs(slope).if_less(infinite, zero, zero);
        zero.if_less(Scalar::abs(self), self * slope, at_zero)
    }
    /// The power `x^a` as a factor of the slope of another power: its own differentials are formed by
    /// [`along_slope`](Self::along_slope).
    #[inline(always)]
    fn slope_power(self, a: f64) -> Self {
        if a == -1.0 { self.recip() } else { self.powf(a) }
    }
    /// `e^x`.
    fn exp(self) -> Self;
    /// `e^x - 1`, without cancellation near 0.
    fn exp_m1(self) -> Self;
    /// The natural logarithm.
    fn ln(self) -> Self;
    /// `ln(1 + x)`, without cancellation near 0.
    fn ln_1p(self) -> Self;
    /// Sine and cosine together, at hardly more cost than one of them.
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
    /// Sine and versine `1 - cos x` together, both computed by the half angle, so that the versine has no cancellation
    /// near 0.
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
    /// Numbers that are piecewise constant functions of this one, such as the coefficients of a [`Table`](crate::table::Table).
    /// `of` is applied to the value, in SIMD lanes to that of each lane. The differentials are 0.
    #[inline(always)]
    fn piecewise<const K: usize>(self, of: impl Fn(f64) -> [f64; K] + Copy) -> [Self; K] {
        of(self.re()).map(Self::from)
    }
    /// The order of the derivatives that the number carries: the number of duals that are nested in its type.
    const ORDER: u32 = 0;

    /// Runs a computation over these numbers in a function of its own, compiled with the instruction set that they
    /// need, for programs that are too long to be inlined into each calling kernel, such as interpreters. The functions
    /// that `work` calls must be `#[inline(always)]`.
    #[inline(never)]
    fn apart<R>(work: impl FnOnce() -> R) -> R {
        work()
    }
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
    fn if_less(self, than: Self, then: Self, otherwise: Self) -> Self {
        if self < than {
            then
        } else if self >= than {
            otherwise
        } else {
            f64::NAN
        }
    }
    #[inline]
    fn abs(self) -> Self {
        f64::abs(self)
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
    #[inline(always)]
    fn along_slope(self, slope: Self) -> Self {
        if self == 0.0 && slope.is_infinite() { 0.0 } else { self * slope }
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
    /// Two independent calls, so that the compiler removes the one whose result is not used, such as the versine in a
    /// force.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Dual, support::KernelDual};
    use nalgebra::SVector;

    /// A number with a first and a second derivative along one direction.
    type SecondAlong = Dual<Dual<f64, SVector<f64, 1>>, SVector<Dual<f64, SVector<f64, 1>>, 1>>;

    fn moving(x: f64) -> SecondAlong {
        Dual { re: Dual { re: x, d: SVector::<f64, 1>::new(1.0) }, d: SVector::<_, 1>::new(Dual::from(1.0)) }
    }

    /// The value with the first and the second derivative.
    fn jet(x: SecondAlong) -> [f64; 3] {
        assert_eq!(x.re.d[0], x.d[0].re, "the first derivative stands twice");
        [x.re.re, x.re.d[0], x.d[0].d[0]]
    }

    #[test]
    fn what_is_chosen_comes_with_its_derivatives() {
        let square = |x: SecondAlong| x.if_less(SecondAlong::zero(), x * x, x.powi(3));
        assert_eq!(jet(square(moving(-2.0))), [4.0, -4.0, 2.0]);
        assert_eq!(jet(square(moving(2.0))), [8.0, 12.0, 12.0]);
        assert_eq!(jet(Scalar::max(moving(2.0), SecondAlong::one())), [2.0, 1.0, 0.0]);
        assert_eq!(jet(Scalar::max(moving(0.5), SecondAlong::one())), [1.0, 0.0, 0.0]);
        assert_eq!(jet(Scalar::min(moving(2.0), SecondAlong::one())), [1.0, 0.0, 0.0]);
        assert_eq!(jet(Scalar::min(moving(0.5), SecondAlong::one())), [0.5, 1.0, 0.0]);
        assert_eq!(jet(moving(-3.0).abs().powi(3)), [27.0, -27.0, 18.0]);
        assert_eq!(jet(moving(-3.0).signum()), [-1.0, 0.0, 0.0]);
        // The value that is not selected has no influence, even where it is infinite.
        let root = |x: SecondAlong| x.if_less(SecondAlong::zero(), SecondAlong::zero(), x.sqrt());
        assert_eq!(jet(root(moving(-1.0))), [0.0; 3]);
        assert_eq!(jet(SecondAlong::zero().if_less(moving(1.0), moving(0.0), moving(0.0).ln())), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn ties_and_numbers_that_are_none() {
        assert_eq!(jet(Scalar::max(moving(1.0), SecondAlong::one())), [1.0, 1.0, 0.0]);
        assert_eq!(jet(Scalar::max(SecondAlong::one(), moving(1.0))), [1.0, 0.0, 0.0]);
        assert_eq!(jet(Scalar::min(moving(1.0), SecondAlong::one())), [1.0, 1.0, 0.0]);
        assert_eq!(jet(Scalar::min(SecondAlong::one(), moving(1.0))), [1.0, 0.0, 0.0]);
        assert_eq!(jet(moving(0.0).abs()), [0.0; 3]);
        assert_eq!([0.0, -0.0].map(Scalar::signum), [0.0; 2]);
        for (a, b) in [(f64::NAN, 1.0), (1.0, f64::NAN)] {
            let of = |x: f64| KernelDual::<f64, SVector<f64, 1>>::from(x);
            assert!(a.if_less(b, 2.0, 3.0).is_nan());
            assert!(Scalar::max(a, b).is_nan() && Scalar::min(a, b).is_nan());
            assert!(Scalar::max(of(a), of(b)).re.is_nan() && of(a).if_less(of(b), of(1.0), of(1.0)).d[0].is_nan());
        }
        assert!(Scalar::signum(f64::NAN).is_nan() && Scalar::abs(f64::NAN).is_nan());
        assert_eq!(
            [Scalar::max(f64::INFINITY, 1.0), Scalar::min(f64::NEG_INFINITY, 1.0)],
            [f64::INFINITY, f64::NEG_INFINITY]
        );
    }

    /// `x^a` with its first and its second derivative at a point of `x >= 0`, from the right.
    fn power_jet(x: f64, a: f64) -> [f64; 3] {
        [x.powf(a), a * x.powf(a - 1.0), a * (a - 1.0) * x.powf(a - 2.0)]
    }

    fn close(found: [f64; 3], expected: [f64; 3]) -> bool {
        let near = |a: f64, b: f64| a == b || (a - b).abs() <= 8.0 * f64::EPSILON * b.abs();
        found.into_iter().zip(expected).all(|(a, b)| near(a, b))
    }

    #[test]
    fn powers_have_their_one_sided_derivatives_at_0() {
        for a in [0.25, 0.5, 0.75, 1.25, 1.5, 1.75, 2.5, 3.5, 7.3] {
            for x in [0.0, 1e-12, 0.7] {
                let found = jet(moving(x).powf(a));
                assert!(close(found, power_jet(x, a)), "{x}^{a}: {found:?}");
            }
        }
        assert_eq!(jet(moving(0.0).sqrt()), [0.0, f64::INFINITY, f64::NEG_INFINITY]);
        for n in 1..6 {
            let expected = match n {
                1 => [0.0, 1.0, 0.0],
                2 => [0.0, 0.0, 2.0],
                _ => [0.0; 3],
            };
            assert_eq!(jet(moving(0.0).powi(n)), expected, "0^{n}");
        }
        assert!(moving(0.5).powi(i32::MIN).re.re.is_infinite());
    }

    /// `(q.q)^a` has at 0 a gradient of 0 for `a > 1/2`, and second derivatives of 0 for `a > 1` and infinite ones for
    /// smaller a.
    #[test]
    fn powers_of_squares_have_their_derivatives_at_0() {
        type Two<T> = Dual<T, SVector<T, 2>>;
        let q = SVector::<Two<Two<f64>>, 2>::from_fn(|i, _| {
            let inner = Dual { re: 0.0, d: SVector::<f64, 2>::ith(i, 1.0) };
            Dual { re: inner, d: SVector::from_fn(|k, _| Dual::from(f64::from(i == k))) }
        });
        for a in [1.1, 1.5, 1.9, 2.0, 2.5] {
            let y = q.dot(&q).powf(a);
            let still = SVector::<f64, 2>::zeros();
            assert_eq!((y.re.re, y.re.d), (0.0, still), "{a}");
            assert!(y.d.iter().all(|row| row.re == 0.0 && row.d == still), "{a}: {y:?}");
        }
        let y = q.dot(&q).powf(0.75);
        assert_eq!((y.re.d, y.d[0].d[0]), (SVector::<f64, 2>::zeros(), f64::INFINITY));
        // Where the value is infinite, a differential of 0 gives NaN.
        assert!(q.dot(&q).powf(-0.5).re.d[0].is_nan() && q.dot(&q).sqrt().recip().re.d[0].is_nan());
        // A constant has derivatives of 0, and NaN has derivatives of NaN.
        assert_eq!(jet(SecondAlong::zero().sqrt()), [0.0; 3]);
        assert_eq!(jet(SecondAlong::zero().powf(0.3)), [0.0; 3]);
        let none = (moving(0.0) * moving(0.0) - 1.0).sqrt();
        assert!(none.re.re.is_nan() && none.re.d[0].is_nan() && none.d[0].d[0].is_nan());
        let none = (moving(0.0) * moving(0.0) - 1.0).powf(1.5);
        assert!(none.re.re.is_nan() && none.re.d[0].is_nan());
    }

    #[test]
    fn a_branch_that_is_not_taken_leaves_no_trace() {
        let zero = SecondAlong::zero();
        let branches = |x: SecondAlong| zero.if_less(x, x.powf(2.5) + x.sqrt() + x.ln() + x.recip(), zero);
        for x in [-1.0, -0.0, 0.0] {
            assert_eq!(jet(branches(moving(x))), [0.0; 3], "{x}");
        }
        let taken = zero.if_less(moving(1.0), (moving(1.0) - 2.0).sqrt(), zero);
        assert!(taken.re.re.is_nan() && taken.re.d[0].is_nan() && taken.d[0].d[0].is_nan());
        let compared = moving(f64::NAN).if_less(zero, zero, zero);
        assert!(compared.re.re.is_nan() && compared.re.d[0].is_nan() && compared.d[0].d[0].is_nan());
    }
}
