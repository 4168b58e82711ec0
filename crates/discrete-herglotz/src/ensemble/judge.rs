//! The convergence test of the iteration for Gauss collocation, lane by lane.

use crate::numbers::simd_batch::SimdBatch;
use num_traits::Zero;
use pulp::Simd;

/// The number of iterations after which the iteration counts as not converging.
const LIMIT: u32 = 60;

/// The convergence test `FixedPointIteration` of `gauss/stages/fixed_point.rs`, lane by lane.
#[derive(Clone, Copy)]
pub(crate) struct Judge<S: Simd, const K: usize> {
    before: SimdBatch<S, K>,
    ratio: SimdBatch<S, K>,
    /// 1 where the next iteration is the last.
    last: SimdBatch<S, K>,
    risen: SimdBatch<S, K>,
    pub count: u32,
}

impl<S: Simd, const K: usize> Judge<S, K> {
    #[inline(always)]
    pub fn new() -> Self {
        let zero = SimdBatch::zero();
        Judge { before: zero, ratio: zero, last: zero, risen: zero, count: 0 }
    }

    /// Tests an iteration by the largest change and the largest term of each lane. The first result is 1 where the
    /// iteration continues, the second where it has failed.
    #[inline(always)]
    pub fn judge(&mut self, change: SimdBatch<S, K>, size: SimdBatch<S, K>) -> [SimdBatch<S, K>; 2] {
        let [zero, one] = [0.0, 1.0].map(SimdBatch::splat);
        self.count += 1;
        let round_off = size * (0.5 * f64::EPSILON);
        let near = round_off * 256.0;
        // Written so that a lane with a NaN continues here, and fails below.
        let enough = change.at_most(round_off * (1.0 / 16.0), one, self.last * change.at_most(near, one, zero));
        let mut going = one - enough;
        let mut given_up = one - (change + size).at_most(SimdBatch::splat(f64::MAX), one, zero);
        if self.count > 1 {
            let ratio = change / self.before;
            let slower = if self.count > 2 { self.ratio } else { SimdBatch::splat(0.1) };
            let expected = ratio.at_most(slower, slower, ratio);
            let next = change * expected;
            let left = round_off * (1.0 / 64.0);
            going = next.at_most(left, zero, going);
            self.last = (next * expected).at_most(left, one, zero);
            let rises = one.at_most(ratio, one, zero);
            going = (rises * change.at_most(near, one, zero)).at_most(zero, going, zero);
            self.risen += rises;
            let slow = if self.count > LIMIT { one } else { self.risen.at_most(SimdBatch::splat(3.0), zero, one) };
            given_up = slow.at_most(zero, given_up, one);
            self.ratio = ratio;
        }
        self.before = change;
        [going, given_up * going]
    }
}
