//! [`Scalar`] for the dual numbers of the crate num-dual, for an independent check of the derivatives.

use crate::Scalar;
use num_dual::{Dual2_64, Dual64, DualNum, HyperDual64};

macro_rules! scalar {
    ($($number:ty),*) => {$(
        impl Scalar for $number {
            fn re(self) -> f64 {
                self.re
            }
            /// The extent of the value alone, since num-dual has no uniform access to the differentials.
            fn extent(self) -> f64 {
                Scalar::extent(self.re)
            }
            fn if_less(self, than: Self, then: Self, otherwise: Self) -> Self {
                if self.re < than.re {
                    then
                } else if self.re >= than.re {
                    otherwise
                } else {
                    f64::NAN.into()
                }
            }
            fn abs(self) -> Self {
                self * Scalar::signum(self.re)
            }
            fn recip(self) -> Self {
                <Self as DualNum>::recip(&self)
            }
            fn sqrt(self) -> Self {
                <Self as DualNum>::sqrt(&self)
            }
            fn powi(self, n: i32) -> Self {
                <Self as DualNum>::powi(&self, n)
            }
            fn powf(self, a: f64) -> Self {
                <Self as DualNum>::powf(&self, a)
            }
            fn exp(self) -> Self {
                <Self as DualNum>::exp(&self)
            }
            fn exp_m1(self) -> Self {
                <Self as DualNum>::exp_m1(&self)
            }
            fn ln(self) -> Self {
                <Self as DualNum>::ln(&self)
            }
            fn ln_1p(self) -> Self {
                <Self as DualNum>::ln_1p(&self)
            }
            fn sin_cos(self) -> (Self, Self) {
                <Self as DualNum>::sin_cos(&self)
            }
            fn sinh(self) -> Self {
                <Self as DualNum>::sinh(&self)
            }
            fn cosh(self) -> Self {
                <Self as DualNum>::cosh(&self)
            }
            fn tanh(self) -> Self {
                <Self as DualNum>::tanh(&self)
            }
            fn atan(self) -> Self {
                <Self as DualNum>::atan(&self)
            }
        }
    )*};
}
scalar!(Dual64, Dual2_64, HyperDual64);
