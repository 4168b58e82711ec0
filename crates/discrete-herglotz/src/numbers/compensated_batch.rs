//! Sums of packs that lose nothing over many steps, as those of `gauss/compensated.rs`.

use crate::numbers::simd_batch::SimdBatch;
use num_traits::Zero;
use pulp::Simd;

/// A coefficient with the part that one double leaves out.
pub(crate) type Pair = [f64; 2];

/// A number with the part that its last digit leaves out.
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

/// A sum with what its rounding takes away, by Knuth: either number may be the larger.
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

    /// `c x`, exact but for what is below the round-off of the rest.
    #[inline(always)]
    pub fn product([head, tail]: Pair, x: Self) -> Self {
        let [head, tail] = [head, tail].map(SimdBatch::splat);
        let value = head * x.value;
        CompensatedBatch { value, rest: head.mul_add(x.value, -value) + tail.mul_add(x.value, head * x.rest) }
    }

    /// With one more product: the parts each for themselves.
    #[inline(always)]
    pub fn plus(self, [head, tail]: Pair, x: SimdBatch<S, K>) -> Self {
        CompensatedBatch {
            value: SimdBatch::splat(head).mul_add(x, self.value),
            rest: SimdBatch::splat(tail).mul_add(x, self.rest),
        }
    }

    /// The sum of the parts, each for itself.
    #[inline(always)]
    pub fn with(self, b: Self) -> Self {
        CompensatedBatch { value: self.value + b.value, rest: self.rest + b.rest }
    }

    /// With a change in two parts, of which the rest is below the round-off of the value and would be lost in their sum.
    #[inline(always)]
    pub fn add(self, change: Self) -> Self {
        let change = exact_sum(change.value, change.rest + self.rest);
        let CompensatedBatch { value, rest } = exact_sum(self.value, change.value);
        CompensatedBatch { value, rest: rest + change.rest }
    }
}
