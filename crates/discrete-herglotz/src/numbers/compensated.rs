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
    /// fused multiply-add, without which it is slow.
    #[inline(always)]
    pub fn times(self, x: CompensatedSum) -> Self {
        let head = self.head * x.value;
        let lost = self.head.mul_add(x.value, -head);
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
