//! Numbers with a running error bound.

use crate::{Scalar, scalar_operators};
use std::ops::Neg;

/// A number with the size of its terms: a running bound of its rounding error, in units of machine epsilon.
///
/// For a sum that vanishes up to rounding, `value / size` is at most about epsilon; for a sum without cancellation it
/// is of order one. The quotient does not depend on units, so that it distinguishes zero from a small number at any
/// scale. Constants are exact. (N. J. Higham, "Accuracy and Stability of Numerical Algorithms", section 3.3.)
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rounded {
    pub value: f64,
    pub size: f64,
}

impl Rounded {
    /// The result of an operation: the propagated errors of the operands and one rounding. The rounding of subnormal
    /// numbers is absolute.
    #[inline]
    fn new(value: f64, carried: f64) -> Self {
        let rounding = if value == 0.0 { 0.0 } else { value.abs() + f64::MIN_POSITIVE };
        Rounded { value, size: carried + rounding }
    }

    /// `f(x)` given its value and its slope. An exact argument contributes no error, however large the slope.
    #[inline]
    fn through(self, value: f64, slope: f64) -> Self {
        Rounded::new(value, if self.size == 0.0 { 0.0 } else { slope.abs() * self.size })
    }

    /// The value relative to its terms; 0 if it is zero, NaN if the value or its size is not finite.
    pub fn relative(self) -> f64 {
        if !(self.value.is_finite() && self.size.is_finite()) {
            f64::NAN
        } else if self.value == 0.0 {
            0.0
        } else {
            self.value.abs() / self.size
        }
    }
}

impl From<f64> for Rounded {
    #[inline]
    fn from(value: f64) -> Self {
        Rounded { value, size: 0.0 }
    }
}

/// Compares the values alone.
impl PartialEq for Rounded {
    fn eq(&self, b: &Self) -> bool {
        self.value == b.value
    }
}

impl Neg for Rounded {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        Rounded { value: -self.value, size: self.size }
    }
}

scalar_operators! { [] Rounded;
    a + b = Rounded::new(a.value + b.value, a.size + b.size);
    c - d = Rounded::new(c.value - d.value, c.size + d.size);
    e * f = Rounded::new(e.value * f.value, e.value.abs() * f.size + f.value.abs() * e.size);
    g / h = Rounded::new(g.value / h.value, (g.size + (g.value / h.value).abs() * h.size) / h.value.abs());
}

impl Scalar for Rounded {
    fn re(self) -> f64 {
        self.value
    }
    fn extent(self) -> f64 {
        self.value.extent()
    }
    fn if_less(self, than: Self, then: Self, otherwise: Self) -> Self {
        if self.value < than.value {
            then
        } else if self.value >= than.value {
            otherwise
        } else {
            f64::NAN.into()
        }
    }
    fn abs(self) -> Self {
        Rounded { value: self.value.abs(), size: self.size }
    }
    fn recip(self) -> Self {
        let r = self.value.recip();
        self.through(r, r * r)
    }
    fn sqrt(self) -> Self {
        let r = self.value.sqrt();
        self.through(r, 0.5 / r)
    }
    /// Counts as many roundings as there may be products.
    fn powi(self, n: i32) -> Self {
        let (value, n_real) = (self.value.powi(n), f64::from(n));
        let mut power = self.through(value, n_real * self.value.powi(n.saturating_sub(1)));
        power.size += n_real.abs() * value.abs();
        power
    }
    fn powf(self, a: f64) -> Self {
        self.through(self.value.powf(a), a * self.value.powf(a - 1.0))
    }
    fn exp(self) -> Self {
        let e = self.value.exp();
        self.through(e, e)
    }
    fn exp_m1(self) -> Self {
        self.through(self.value.exp_m1(), self.value.exp())
    }
    fn ln(self) -> Self {
        self.through(self.value.ln(), self.value.recip())
    }
    fn ln_1p(self) -> Self {
        self.through(self.value.ln_1p(), (1.0 + self.value).recip())
    }
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.value.sin_cos();
        (self.through(s, c), self.through(c, s))
    }
    fn sinh(self) -> Self {
        self.through(self.value.sinh(), self.value.cosh())
    }
    fn cosh(self) -> Self {
        self.through(self.value.cosh(), self.value.sinh())
    }
    fn tanh(self) -> Self {
        let t = self.value.tanh();
        self.through(t, 1.0 - t * t)
    }
    fn atan(self) -> Self {
        self.through(self.value.atan(), (1.0 + self.value * self.value).recip())
    }
}
