//! Sums that lose nothing over many steps.

use crate::numbers::state_words::saved;
use qd::Quad;
use std::ops::{Add, Mul};

/// A number with the part that its last digit leaves out, so that a sum of small changes loses nothing.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CompensatedSum {
    pub value: f64,
    pub rest: f64,
}

impl From<f64> for CompensatedSum {
    fn from(value: f64) -> Self {
        CompensatedSum { value, rest: 0.0 }
    }
}

impl CompensatedSum {
    /// Adds a change in two parts, of which the tail is below the round-off of the head and would be lost in their sum.
    #[inline(always)]
    pub fn add(&mut self, Unevaluated { head, tail }: Unevaluated) {
        let (change, lost) = exact_sum(head, tail + self.rest);
        let (value, rest) = exact_sum(self.value, change);
        (self.value, self.rest) = (value, rest + lost);
    }
}

/// A sum with what its rounding takes away, by Knuth: either number may be the larger.
#[inline(always)]
pub(crate) fn exact_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// A number in two parts that are not added: what the coefficients of a step leave out of one double acts in the same
/// direction in every step, and so it is carried along.
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
    /// The product with a compensated number, exact but for what is below the round-off of the tail. To be compiled for
    /// instruction sets with a fused product, which is slow where there is none.
    #[inline(always)]
    pub fn times(self, x: CompensatedSum) -> Self {
        let head = self.head * x.value;
        let lost = self.head.mul_add(x.value, -head);
        Unevaluated { head, tail: lost + (self.tail * x.value + self.head * x.rest) }
    }

    /// The sum, exact but for what is below the round-off of the tail.
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

/// Whether changes of positions, of velocities or momenta, and of the action are finite: a sum hides no NaN.
#[inline(always)]
pub(crate) fn finite<const N: usize>(dq: &[Unevaluated; N], dy: &[Unevaluated; N], dz: Unevaluated) -> bool {
    (0..N).fold(dz.head, |sum, d| sum + (dq[d].head + dy[d].head)).is_finite()
}

/// Adds changes.
#[inline(always)]
pub(crate) fn add<const N: usize>(x: &mut [CompensatedSum; N], changes: &[Unevaluated; N]) {
    x.iter_mut().zip(changes).for_each(|(x, change)| x.add(*change));
}

saved!([] CompensatedSum { value, rest });
