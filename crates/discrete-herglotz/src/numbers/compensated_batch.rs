//! Compensated summation of SIMD batches, as that of numbers in `numbers/compensated.rs`.

use crate::numbers::simd_batch::SimdBatch;
use num_traits::Zero;
use pulp::Simd;

/// A coefficient in two parts, `[head, tail]`; the tail is the round-off of the head.
pub(crate) type Pair = [f64; 2];

/// A compensated sum: its value, and the compensation term `rest` with the accumulated round-off of the additions.
#[derive(Clone, Copy)]
pub(crate) struct CompensatedBatch<S: Simd, const K: usize> {
    pub value: SimdBatch<S, K>,
    pub rest: SimdBatch<S, K>,
}

impl<S: Simd, const K: usize> From<SimdBatch<S, K>> for CompensatedBatch<S, K> {
    #[inline(always)]
    fn from(value: SimdBatch<S, K>) -> Self {
        CompensatedBatch { value, rest: SimdBatch::zero() }
    }
}

/// The sum and its round-off error, by Knuth's TwoSum; either number may be the larger.
#[inline(always)]
fn exact_sum<S: Simd, const K: usize>(a: SimdBatch<S, K>, b: SimdBatch<S, K>) -> CompensatedBatch<S, K> {
    let value = a + b;
    let of_b = value - a;
    CompensatedBatch { value, rest: (a - (value - of_b)) + (b - of_b) }
}

impl<S: Simd, const K: usize> CompensatedBatch<S, K> {
    #[inline(always)]
    pub fn zero() -> Self {
        SimdBatch::zero().into()
    }

    /// `c x`, up to the round-off of the rest.
    #[inline(always)]
    pub fn product([head, tail]: Pair, x: Self) -> Self {
        let (head, tail) = (SimdBatch::splat(head), SimdBatch::splat(tail));
        let value = head * x.value;
        CompensatedBatch { value, rest: head.mul_add(x.value, -value) + tail.mul_add(x.value, head * x.rest) }
    }

    /// `self + c x`, with the values and the rests summed separately.
    #[inline(always)]
    pub fn plus(self, [head, tail]: Pair, x: SimdBatch<S, K>) -> Self {
        CompensatedBatch {
            value: SimdBatch::splat(head).mul_add(x, self.value),
            rest: SimdBatch::splat(tail).mul_add(x, self.rest),
        }
    }

    /// `self + b`, with the values and the rests summed separately.
    #[inline(always)]
    pub fn with(self, b: Self) -> Self {
        CompensatedBatch { value: self.value + b.value, rest: self.rest + b.rest }
    }

    /// The compensated sum with an increment whose rest is below the round-off of its value.
    #[inline(always)]
    pub fn add(self, change: Self) -> Self {
        let change = exact_sum(change.value, change.rest + self.rest);
        let CompensatedBatch { value, rest } = exact_sum(self.value, change.value);
        CompensatedBatch { value, rest: rest + change.rest }
    }
}
