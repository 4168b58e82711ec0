//! Dual numbers: a value with its differential along given directions.

// The product and quotient rules mix operations, which clippy reports as suspicious.
#![allow(clippy::suspicious_arithmetic_impl)]

use crate::{Scalar, numbers::TangentVector};
use num_traits::{One, Zero};
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// A dual number `re + d`: a value and its differential along the directions of the module `D`.
///
/// Duals nest: `Dual<Dual<f64, B>, A>` carries the value, its first derivatives along the directions of `A` and of `B`,
/// and the mixed second derivatives.
///
/// ```
/// use contact_geom::{Dual, Scalar};
/// use nalgebra::SVector;
/// let x = Dual { re: 2.0, d: SVector::<f64, 1>::new(1.0) };
/// let y = x.powi(3);
/// assert_eq!((y.re, y.d[0]), (8.0, 12.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<T, D> {
    /// The value.
    pub re: T,
    /// The differential: the derivative along each direction.
    pub d: D,
}

/// A [`Dual`] for SIMD kernels: all of its operations are inlined into the code that calls them.
///
/// The instruction set of a kernel is selected at run time, and functions that are not inlined into the kernel are
/// compiled without it, at twenty times the cost. Operations of third order are functions of their own, compiled with these
/// instructions: inlined they would be too long. Long programs on nested duals use [`Dual`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KernelDual<T, D> {
    /// The value.
    pub re: T,
    /// The differential: the derivative along each direction.
    pub d: D,
}

/// The order of the derivatives in T from which an operation on duals over T is a function of its own. It is some hundred
/// products there: a call costs little, and the code of a Lagrangian with all of them inlined takes the compiler minutes.
const MIN_ORDER_APART: u32 = 2;

/// Performs an operation on duals over T, in a function of its own where it is long.
#[inline(always)]
fn apart_if_long<T: Scalar, R>(work: impl FnOnce() -> R) -> R {
    if const { T::ORDER >= MIN_ORDER_APART } { T::apart(work) } else { work() }
}

/// An operation on duals over a type, in a function of its own where it is long.
macro_rules! apart {
    ($T:ident, $work:expr) => {
        apart_if_long::<$T, _>(
            #[inline(always)]
            || $work,
        )
    };
}

/// The arithmetic, with the given inline attribute on its functions.
macro_rules! arithmetic {
    ($Dual:ident, $inline:meta) => {
        impl<T: Scalar, D: TangentVector<T>> $Dual<T, D> {
            /// A constant: its differential vanishes.
            #[$inline]
            pub fn constant(re: T) -> Self {
                $Dual { re, d: D::null() }
            }

            /// `f(x)` by the chain rule, given `f(re)` and `f'(re)`.
            #[$inline]
            fn chain(self, value: T, slope: T) -> Self {
                $Dual { re: value, d: self.d.scaled(slope) }
            }

            /// The chain rule where the slope may be infinite at a finite value.
            #[$inline]
            fn chain_from_root(self, value: T, slope: T) -> Self {
                $Dual { re: value, d: self.d.each(|x| x.along_slope(slope)) }
            }
        }

        impl<T: Scalar, D: TangentVector<T>> From<f64> for $Dual<T, D> {
            #[$inline]
            fn from(x: f64) -> Self {
                $Dual::constant(T::from(x))
            }
        }

        impl<T: Scalar, D: TangentVector<T>> Zero for $Dual<T, D> {
            #[$inline]
            fn zero() -> Self {
                $Dual::constant(T::zero())
            }
            fn is_zero(&self) -> bool {
                *self == Self::zero()
            }
        }

        impl<T: Scalar, D: TangentVector<T>> One for $Dual<T, D> {
            #[$inline]
            fn one() -> Self {
                $Dual::constant(T::one())
            }
        }

        impl<T: Scalar, D: TangentVector<T>> Neg for $Dual<T, D> {
            type Output = Self;
            #[$inline]
            fn neg(self) -> Self {
                apart!(T, $Dual { re: -self.re, d: self.d.each(|a| -a) })
            }
        }

        impl<T: Scalar, D: TangentVector<T>> Add for $Dual<T, D> {
            type Output = Self;
            #[$inline]
            fn add(self, b: Self) -> Self {
                apart!(T, $Dual { re: self.re + b.re, d: self.d.join(b.d, |x, y| x + y) })
            }
        }

        impl<T: Scalar, D: TangentVector<T>> Sub for $Dual<T, D> {
            type Output = Self;
            #[$inline]
            fn sub(self, b: Self) -> Self {
                apart!(T, $Dual { re: self.re - b.re, d: self.d.join(b.d, |x, y| x - y) })
            }
        }

        impl<T: Scalar, D: TangentVector<T>> Mul for $Dual<T, D> {
            type Output = Self;
            #[$inline]
            fn mul(self, b: Self) -> Self {
                apart!(T, {
                    let a = self.re;
                    $Dual { re: a * b.re, d: self.d.combined(b.re, b.d, a) }
                })
            }
        }

        impl<T: Scalar, D: TangentVector<T>> Div for $Dual<T, D> {
            type Output = Self;
            #[$inline]
            fn div(self, b: Self) -> Self {
                apart!(T, {
                    let (quotient, inverse) = (self.re / b.re, b.re.recip());
                    $Dual { re: quotient, d: self.d.join(b.d, |x, y| (x - quotient * y) * inverse) }
                })
            }
        }

        impl<T: Scalar, D: TangentVector<T>> Add<f64> for $Dual<T, D> {
            type Output = Self;
            #[$inline]
            fn add(self, b: f64) -> Self {
                apart!(T, $Dual { re: self.re + b, d: self.d })
            }
        }

        impl<T: Scalar, D: TangentVector<T>> Sub<f64> for $Dual<T, D> {
            type Output = Self;
            #[$inline]
            fn sub(self, b: f64) -> Self {
                apart!(T, $Dual { re: self.re - b, d: self.d })
            }
        }

        impl<T: Scalar, D: TangentVector<T>> Mul<f64> for $Dual<T, D> {
            type Output = Self;
            #[$inline]
            fn mul(self, b: f64) -> Self {
                apart!(T, $Dual { re: self.re * b, d: self.d.each(|a| a * b) })
            }
        }

        impl<T: Scalar, D: TangentVector<T>> Div<f64> for $Dual<T, D> {
            type Output = Self;
            #[$inline]
            fn div(self, b: f64) -> Self {
                apart!(T, $Dual { re: self.re / b, d: self.d.each(|a| a / b) })
            }
        }

        impl<T: Scalar, D: TangentVector<T>> AddAssign for $Dual<T, D> {
            #[$inline]
            fn add_assign(&mut self, b: Self) {
                *self = *self + b;
            }
        }

        impl<T: Scalar, D: TangentVector<T>> SubAssign for $Dual<T, D> {
            #[$inline]
            fn sub_assign(&mut self, b: Self) {
                *self = *self - b;
            }
        }

        impl<T: Scalar, D: TangentVector<T>> MulAssign for $Dual<T, D> {
            #[$inline]
            fn mul_assign(&mut self, b: Self) {
                *self = *self * b;
            }
        }

        impl<T: Scalar, D: TangentVector<T>> DivAssign for $Dual<T, D> {
            #[$inline]
            fn div_assign(&mut self, b: Self) {
                *self = *self / b;
            }
        }

        impl<T: Scalar, D: TangentVector<T>> Scalar for $Dual<T, D> {
            const ORDER: u32 = T::ORDER + 1;

            #[$inline]
            fn re(self) -> f64 {
                self.re.re()
            }
            #[$inline]
            fn pivot_size(self) -> f64 {
                self.re.pivot_size()
            }
            #[$inline]
            fn extent(self) -> f64 {
                let mut largest = self.re.extent();
                self.d.each(|a| {
                    largest = largest.max(a.extent());
                    a
                });
                largest
            }
            #[$inline]
            fn if_less(self, than: Self, then: Self, otherwise: Self) -> Self {
                apart!(T, {
                    let (a, b) = (self.re, than.re);
                    $Dual {
                        re: a.if_less(b, then.re, otherwise.re),
                        d: then.d.join(otherwise.d, |x, y| a.if_less(b, x, y)),
                    }
                })
            }
            #[$inline]
            fn abs(self) -> Self {
                apart!(T, self.chain(self.re.abs(), self.re.signum()))
            }
            #[$inline]
            fn recip(self) -> Self {
                apart!(T, {
                    let r = self.re.recip();
                    self.chain(r, -(r * r))
                })
            }
            #[$inline]
            fn sqrt(self) -> Self {
                apart!(T, {
                    let r = self.re.sqrt();
                    self.chain_from_root(r, r.slope_power(-1.0) * 0.5)
                })
            }
            #[$inline]
            fn powi(self, n: i32) -> Self {
                apart!(T, {
                    if n == 0 {
                        return Self::one();
                    }
                    let below = self.re.powi(n.saturating_sub(1));
                    self.chain(below * self.re, below * f64::from(n))
                })
            }
            #[$inline]
            fn powf(self, a: f64) -> Self {
                apart!(T, {
                    // The value is computed separately: the power in the slope is infinite at 0, and overflows or
                    // underflows before the value does.
                    match a {
                        0.0 => Self::one(),
                        1.0 => self,
                        // The value itself is infinite at 0, and a differential of 0 gives NaN there.
                        _ if a < 0.0 => self.chain(self.re.powf(a), self.re.powf(a - 1.0) * a),
                        _ => self.chain_from_root(self.re.powf(a), self.re.slope_power(a - 1.0) * a),
                    }
                })
            }
            #[$inline]
            fn along_slope(self, slope: Self) -> Self {
                apart!(T, {
                    let (x, s) = (self.re, slope.re);
                    $Dual {
                        re: x.along_slope(s),
                        d: self.d.join(slope.d, |dx, ds| dx.along_slope(s) + x.along_slope(ds)),
                    }
                })
            }
            #[$inline]
            fn slope_power(self, a: f64) -> Self {
                apart!(T, {
                    match a {
                        0.0 => Self::one(),
                        1.0 => self,
                        -1.0 => {
                            let r = self.re.slope_power(a);
                            self.chain_from_root(r, -(r * r))
                        }
                        _ => self.chain_from_root(self.re.slope_power(a), self.re.slope_power(a - 1.0) * a),
                    }
                })
            }
            #[$inline]
            fn exp(self) -> Self {
                apart!(T, {
                    let e = self.re.exp();
                    self.chain(e, e)
                })
            }
            #[$inline]
            fn exp_m1(self) -> Self {
                apart!(T, {
                    let e = self.re.exp_m1();
                    self.chain(e, e + 1.0)
                })
            }
            #[$inline]
            fn ln(self) -> Self {
                apart!(T, self.chain(self.re.ln(), self.re.recip()))
            }
            #[$inline]
            fn ln_1p(self) -> Self {
                apart!(T, self.chain(self.re.ln_1p(), (self.re + 1.0).recip()))
            }
            #[$inline]
            fn sin_cos(self) -> (Self, Self) {
                apart!(T, {
                    let (s, c) = self.re.sin_cos();
                    (self.chain(s, c), self.chain(c, -s))
                })
            }
            #[$inline]
            fn sin_versine(self) -> (Self, Self) {
                apart!(T, {
                    let (s, v) = self.re.sin_versine();
                    (self.chain(s, -v + 1.0), self.chain(v, s))
                })
            }
            #[$inline]
            fn sinh(self) -> Self {
                apart!(T, self.chain(self.re.sinh(), self.re.cosh()))
            }
            #[$inline]
            fn cosh(self) -> Self {
                apart!(T, self.chain(self.re.cosh(), self.re.sinh()))
            }
            #[$inline]
            fn tanh(self) -> Self {
                apart!(T, {
                    let t = self.re.tanh();
                    self.chain(t, -(t * t) + 1.0)
                })
            }
            #[$inline]
            fn atan(self) -> Self {
                apart!(T, self.chain(self.re.atan(), (self.re * self.re + 1.0).recip()))
            }
            #[$inline]
            fn piecewise<const K: usize>(self, of: impl Fn(f64) -> [f64; K] + Copy) -> [Self; K] {
                let values = self.re.piecewise(of);
                let mut constants = [Self::zero(); K];
                for i in 0..K {
                    constants[i] = Self::constant(values[i]);
                }
                constants
            }
            #[inline]
            fn apart<R>(work: impl FnOnce() -> R) -> R {
                T::apart(work)
            }
        }
    };
}

arithmetic!(Dual, inline);
arithmetic!(KernelDual, inline(always));
