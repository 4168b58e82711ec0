//! Compensated summation.

use crate::numbers::state_words::saved;
use qd::Quad;
use std::ops::{Add, Mul};

/// A compensated sum: its value, and the compensation term `rest` with the accumulated round-off of the additions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CompensatedSum {
    pub value: f64,
    pub rest: f64,
}

/// Copies the values of compensated sums.
#[inline(always)]
pub(crate) fn copy_values(x: &[CompensatedSum], values: &mut [f64]) {
    for (value, x) in values.iter_mut().zip(x) {
        *value = x.value;
    }
}

impl From<f64> for CompensatedSum {
    fn from(value: f64) -> Self {
        CompensatedSum { value, rest: 0.0 }
    }
}

impl CompensatedSum {
    /// Adds an increment `head + tail`, where the tail is below the round-off of the head.
    #[inline(always)]
    pub fn add(&mut self, Unevaluated { head, tail }: Unevaluated) {
        let (change, lost) = exact_sum(head, tail + self.rest);
        let (value, rest) = exact_sum(self.value, change);
        (self.value, self.rest) = (value, rest + lost);
    }
}

/// The sum and its round-off error, by Knuth's TwoSum; either number may be the larger.
#[inline(always)]
pub fn exact_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// The round-off error of a product, `a b - product` for its rounded value. To be compiled for instruction sets with
/// fused multiply-add.
#[inline(always)]
pub fn lost_in_product(a: f64, b: f64, product: f64) -> f64 {
    if cfg!(target_arch = "wasm32") { by_halves(a, b, product) } else { a.mul_add(b, -product) }
}

/// `a b + c`, fused where the instruction is there: WebAssembly has none, and a function in its place.
#[inline(always)]
pub fn product_plus(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(target_arch = "wasm32") { a * b + c } else { a.mul_add(b, c) }
}

/// The round-off error of a product by Dekker's algorithm (A floating-point technique for extending the available precision,
/// 1971): the products of the halves of the factors are exact. It is 0 where a factor exceeds 1e300, whose halves overflow.
#[inline(always)]
fn by_halves(a: f64, b: f64, product: f64) -> f64 {
    let halves = |x: f64| {
        let scaled = 134_217_729.0 * x;
        let high = scaled - (scaled - x);
        (high, x - high)
    };
    let ((a, a_low), (b, b_low)) = (halves(a), halves(b));
    let lost = ((a * b - product) + a * b_low + a_low * b) + a_low * b_low;
    if lost.is_finite() { lost } else { 0.0 }
}

/// An unevaluated sum `head + tail`. The round-off of the coefficients of a step acts in the same direction in every
/// step; the tail keeps it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Unevaluated {
    pub head: f64,
    pub tail: f64,
}

impl Add for Unevaluated {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Unevaluated { head: self.head + b.head, tail: self.tail + b.tail }
    }
}

impl Mul<f64> for Unevaluated {
    type Output = Self;
    #[inline(always)]
    fn mul(self, x: f64) -> Self {
        Unevaluated { head: self.head * x, tail: self.tail * x }
    }
}

impl Unevaluated {
    /// The product with a compensated sum, up to the round-off of the tail. To be compiled for instruction sets with
    /// fused multiply-add.
    #[inline(always)]
    pub fn times(self, x: CompensatedSum) -> Self {
        let head = self.head * x.value;
        let lost = lost_in_product(self.head, x.value, head);
        Unevaluated { head, tail: lost + (self.tail * x.value + self.head * x.rest) }
    }

    /// The sum, up to the round-off of the tail.
    #[inline(always)]
    pub fn plus(self, b: Self) -> Self {
        let (head, lost) = exact_sum(self.head, b.head);
        Unevaluated { head, tail: lost + (self.tail + b.tail) }
    }
}

impl From<Quad> for Unevaluated {
    fn from(x: Quad) -> Self {
        Unevaluated { head: x.0, tail: x.1 }
    }
}

/// Whether the increments of positions, of velocities or momenta, and of the action are finite; any NaN or infinity
/// makes their sum not finite.
#[inline(always)]
pub(crate) fn finite(dq: &[Unevaluated], dy: &[Unevaluated], dz: Unevaluated) -> bool {
    let mut sum = dz.head;
    for (dq, dy) in dq.iter().zip(dy) {
        sum += dq.head + dy.head;
    }
    sum.is_finite()
}

/// Adds increments to compensated sums.
#[inline(always)]
pub(crate) fn add(x: &mut [CompensatedSum], changes: &[Unevaluated]) {
    for (x, change) in x.iter_mut().zip(changes) {
        x.add(*change);
    }
}

saved!([] CompensatedSum { value, rest });

#[cfg(test)]
mod tests {
    use super::*;

    /// They are those of fused multiply-add, in factors up to 1e300, and where the error does not underflow.
    #[test]
    fn errors_of_products_are_exact() {
        for k in 1..5000 {
            let (a, b) = ((f64::from(k)).sin() * 10f64.powi(k % 571 - 270), f64::from(k * k).cos());
            assert_eq!(by_halves(a, b, a * b), a.mul_add(b, -(a * b)), "{a} {b}");
            assert_eq!(by_halves(b, a, a * b), a.mul_add(b, -(a * b)), "{b} {a}");
        }
    }

    #[test]
    fn products_that_overflow_have_no_error() {
        assert_eq!(by_halves(1e308, 0.5, 5e307), 0.0);
        assert_eq!(by_halves(1e200, 1e200, f64::INFINITY), 0.0);
    }
}
