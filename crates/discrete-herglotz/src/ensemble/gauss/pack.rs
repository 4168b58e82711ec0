//! The motions of a pack.

use crate::ensemble::convergence::ConvergenceTest;
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::numbers::compensated_batch::CompensatedBatch;
use crate::numbers::simd_batch::SimdBatch;
use pulp::Simd;

/// The state and the workspace of the motions of a pack.
pub(super) struct Pack<S: Simd, const K: usize, const N: usize> {
    pub q: [CompensatedBatch<S, K>; N],
    pub v: [CompensatedBatch<S, K>; N],
    pub z: CompensatedBatch<S, K>,
    /// The accelerations of the stages, and their positions.
    pub a: [[SimdBatch<S, K>; N]; MAX_STAGES],
    pub x: [[SimdBatch<S, K>; N]; MAX_STAGES],
    /// The part of the positions that is the same in all iterations: the contributions of the state, and of the low
    /// parts of the coefficients.
    pub base: [[SimdBatch<S, K>; N]; MAX_STAGES],
    /// 1 in lanes whose iteration continues, and 1 in lanes that have failed.
    pub continuing: SimdBatch<S, K>,
    pub failed: SimdBatch<S, K>,
    /// Whether the iteration continues in members lane, and whether it continues in all lanes; the largest change and
    /// the largest term of the last iteration.
    pub open: bool,
    pub whole: bool,
    pub change: SimdBatch<S, K>,
    pub size: SimdBatch<S, K>,
    pub convergence: ConvergenceTest<S, K>,
    /// The largest velocity of the last steps, and 1 in lanes with a suspect step.
    pub fast: SimdBatch<S, K>,
    pub suspect: SimdBatch<S, K>,
}
