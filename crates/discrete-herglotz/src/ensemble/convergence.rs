//! The convergence test of the iteration for Gauss collocation, lane by lane.

use crate::numbers::simd_batch::SimdBatch;
use num_traits::Zero;
use pulp::Simd;

/// The number of iterations after which the iteration counts as not converging: a contraction by one half reaches
/// round-off before.
const MAX_ITERATIONS: u32 = 60;

/// The number of increases of the changes above round-off after which the iteration counts as not converging.
const MAX_INCREASES: f64 = 3.0;

/// The change, in units of the round-off of the terms, below which the iteration has converged.
const MAX_CONVERGED_CHANGE: f64 = 1.0 / 16.0;

/// The predicted change, in units of the round-off of the terms, below which it is not computed: the remaining error
/// has the same direction in every step, and accumulates faster than round-off.
const MAX_REMAINING_CHANGE: f64 = 1.0 / 64.0;

/// The change, in units of the round-off of the terms, below which an increase is due to round-off.
const MAX_ROUND_OFF_CHANGE: f64 = 256.0;

/// The contraction factor that is assumed after the first two changes, if theirs is smaller: it is often that of
/// components that decay at once.
const MIN_FIRST_CONTRACTION: f64 = 0.1;

/// The convergence test `FixedPointIteration` of `gauss/stages/fixed_point.rs`, lane by lane.
///
/// Both exist because they share the conditions and not the computation: the scalar test returns at the first condition
/// that holds, and also knows the secant steps and the round-off of the positions of a single run; here all conditions
/// are evaluated as numbers 0 and 1 in every iteration, since a branch would have to be the same in all lanes. A change
/// of one must be made in the other.
#[derive(Clone, Copy)]
pub(crate) struct ConvergenceTest<S: Simd, const K: usize> {
    before: SimdBatch<S, K>,
    ratio: SimdBatch<S, K>,
    /// 1 where the next iteration is the last.
    last: SimdBatch<S, K>,
    increases: SimdBatch<S, K>,
    pub count: u32,
}

impl<S: Simd, const K: usize> ConvergenceTest<S, K> {
    #[inline(always)]
    pub fn new() -> Self {
        let zero = SimdBatch::zero();
        ConvergenceTest { before: zero, ratio: zero, last: zero, increases: zero, count: 0 }
    }

    /// Tests an iteration by the largest change and the largest term of each lane. The first result is 1 where the
    /// iteration continues, the second where it has failed.
    #[inline(always)]
    pub fn test(&mut self, change: SimdBatch<S, K>, size: SimdBatch<S, K>) -> [SimdBatch<S, K>; 2] {
        let [zero, one] = [0.0, 1.0].map(SimdBatch::splat);
        self.count += 1;
        let round_off = size * (0.5 * f64::EPSILON);
        let near = round_off * MAX_ROUND_OFF_CHANGE;
        // Written so that a lane with a NaN continues here, and fails below.
        let enough = change.at_most(round_off * MAX_CONVERGED_CHANGE, one, self.last * change.at_most(near, one, zero));
        let mut continuing = one - enough;
        let mut failing = one - (change + size).at_most(SimdBatch::splat(f64::MAX), one, zero);
        if self.count > 1 {
            let ratio = change / self.before;
            let slower = if self.count > 2 { self.ratio } else { SimdBatch::splat(MIN_FIRST_CONTRACTION) };
            let expected = ratio.at_most(slower, slower, ratio);
            let next = change * expected;
            let left = round_off * MAX_REMAINING_CHANGE;
            continuing = next.at_most(left, zero, continuing);
            self.last = (next * expected).at_most(left, one, zero);
            let increased = one.at_most(ratio, one, zero);
            continuing = (increased * change.at_most(near, one, zero)).at_most(zero, continuing, zero);
            self.increases += increased;
            let slow = if self.count > MAX_ITERATIONS {
                one
            } else {
                self.increases.at_most(SimdBatch::splat(MAX_INCREASES), zero, one)
            };
            failing = slow.at_most(zero, failing, one);
            self.ratio = ratio;
        }
        self.before = change;
        [continuing, failing * continuing]
    }
}
