//! Values at the stages of a collocation step, and linear maps between them, in vector lanes.

use super::coefficients::MOST;
use super::compensated::Twofold;
use crate::gauss::lanes::Lanes;
use crate::run::saved::Saved;
use pulp::Simd;
use qd::Quad;
use std::array::from_fn;

/// One number for each stage, padded to whole registers. What is beyond the last stage repeats it, so that formulas that are
/// regular at the stages are so everywhere, or is multiplied by 0.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Stages(pub [f64; MOST]);

impl Stages {
    pub const ZERO: Stages = Stages([0.0; MOST]);

    pub fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        Stages(self.0.map(f))
    }

    #[inline(always)]
    pub fn block<S: Simd>(&self, r: usize) -> Lanes<S> {
        // As a number: what is only moved the compiler takes for bytes, and moves by halves where it prefers those.
        -(-Lanes(S::as_simd_f64s(&self.0).0[r]))
    }

    #[inline(always)]
    pub fn set<S: Simd>(&mut self, r: usize, x: Lanes<S>) {
        S::as_mut_simd_f64s(&mut self.0).0[r] = x.0;
    }

    /// The sum of what is 0 beyond the last stage.
    #[inline(always)]
    pub fn sum<S: Simd>(&self, s: usize) -> f64 {
        let mut sum = Lanes::<S>::splat(0.0);
        for r in 0..blocks::<S>(s) {
            sum += self.block(r);
        }
        sum.sum()
    }
}

/// The registers that hold `s` stages.
#[inline(always)]
pub(super) fn blocks<S: Simd>(s: usize) -> usize {
    s.div_ceil(Lanes::<S>::COUNT)
}

/// Numbers for the stages in double-double precision, with 0 beyond the last.
pub(crate) type Exact = [Quad; MOST];

/// The leading parts of numbers for the stages, the last one repeated beyond it.
pub(super) fn padded(x: &Exact, s: usize) -> Stages {
    Stages(from_fn(|i| x[i.min(s - 1)].0))
}

/// Weights of the stages, 0 beyond the last, with the part that one double leaves out.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights {
    head: Stages,
    tail: Stages,
}

impl Weights {
    pub fn new(x: &Exact) -> Self {
        Weights { head: Stages(x.map(|w| w.0)), tail: Stages(x.map(|w| w.1)) }
    }

    /// The weighted sum over the stages.
    #[inline(always)]
    pub fn sum<S: Simd>(&self, x: &Stages, s: usize) -> Twofold {
        let mut head = Lanes::<S>::splat(0.0);
        let mut tail = Lanes::<S>::splat(0.0);
        for r in 0..blocks::<S>(s) {
            head = self.head.block(r).mul_add(x.block(r), head);
            tail = self.tail.block(r).mul_add(x.block(r), tail);
        }
        Twofold { head: head.sum(), tail: tail.sum() }
    }
}

/// A linear map between stage values, by columns.
#[derive(Clone, Debug)]
pub(crate) struct StageMap(pub [Stages; MOST]);

impl StageMap {
    /// The map with these rows.
    pub fn new(rows: &[[f64; MOST]; MOST], s: usize) -> Self {
        StageMap(from_fn(|j| Stages(from_fn(|i| rows[i.min(s - 1)][j]))))
    }

    pub fn from_exact(rows: &[Exact; MOST], s: usize) -> Self {
        Self::new(&rows.map(|row| row.map(|e| e.0)), s)
    }

    /// `y = start + M x`.
    ///
    /// Several registers at a time, even and odd columns apart: the sums that are under way keep the multipliers busy.
    #[inline(always)]
    pub fn apply<S: Simd>(&self, x: &Stages, s: usize, y: &mut Stages, start: impl Fn(usize) -> Lanes<S>) {
        let m = blocks::<S>(s);
        let mut r = 0;
        while const { 4 * S::F64_LANES <= MOST } && r + 4 <= m {
            r = self.rows::<S, 4>(x, s, y, &start, r);
        }
        while r + 2 <= m {
            r = self.rows::<S, 2>(x, s, y, &start, r);
        }
        if r < m {
            self.rows::<S, 1>(x, s, y, &start, r);
        }
    }

    /// The same for K registers from the r-th on.
    #[inline(always)]
    fn rows<S: Simd, const K: usize>(
        &self,
        x: &Stages,
        s: usize,
        y: &mut Stages,
        start: &impl Fn(usize) -> Lanes<S>,
        r: usize,
    ) -> usize {
        let (mut even, mut odd): ([_; K], _) = (from_fn(|i| start(r + i)), [Lanes::<S>::splat(0.0); K]);
        for pair in 0..s.min(MOST).div_ceil(2) {
            let (k, l) = (2 * pair, 2 * pair + 1);
            let (a, b) = (Lanes::splat(x.0[k]), Lanes::splat(x.0[l]));
            for i in 0..K {
                even[i] = self.0[k].block(r + i).mul_add(a, even[i]);
                odd[i] = self.0[l].block(r + i).mul_add(b, odd[i]);
            }
        }
        for i in 0..K {
            y.set(r + i, even[i] + odd[i]);
        }
        r + K
    }
}

impl Saved for Stages {
    fn save(&self, to: &mut Vec<u64>) {
        self.0.save(to);
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        self.0.load(from)
    }
}
