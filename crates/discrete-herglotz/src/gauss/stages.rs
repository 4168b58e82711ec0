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
    #[inline(always)]
    pub fn apply<S: Simd>(&self, x: &Stages, s: usize, y: &mut Stages, start: impl Fn(usize) -> Lanes<S>) {
        let m = blocks::<S>(s);
        let mut r = 0;
        while const { 4 * S::F64_LANES <= MOST } && r + 4 <= m {
            r = self.rows::<S, 4, 1>([x], s, [y], &|_, r| start(r), r);
        }
        while r + 2 <= m {
            r = self.rows::<S, 2, 1>([x], s, [y], &|_, r| start(r), r);
        }
        if r < m {
            self.rows::<S, 1, 1>([x], s, [y], &|_, r| start(r), r);
        }
    }

    /// The same of N vectors, `y_d = start_d + M x_d`: two at a time, so that the matrix is loaded half as often. The same bits.
    #[inline(always)]
    pub fn apply_to_each<S: Simd, const N: usize>(
        &self,
        x: &[Stages; N],
        s: usize,
        y: &mut [Stages; N],
        start: impl Fn(usize, usize) -> Lanes<S>,
    ) {
        let m = blocks::<S>(s);
        for (i, (x, y)) in x.chunks(2).zip(y.chunks_mut(2)).enumerate() {
            let start = |d: usize, r| start(2 * i + d, r);
            match (x, y) {
                ([a, b], [c, d]) => {
                    let mut r = 0;
                    while r + 2 <= m {
                        r = self.rows::<S, 2, 2>([a, b], s, [c, d], &start, r);
                    }
                    if r < m {
                        self.rows::<S, 1, 2>([a, b], s, [c, d], &start, r);
                    }
                }
                ([a], [c]) => self.apply(a, s, c, |r| start(0, r)),
                _ => {}
            }
        }
    }

    /// The same of D vectors for K registers from the r-th on.
    ///
    /// Even and odd columns apart: the sums that are under way keep the multipliers busy.
    #[inline(always)]
    fn rows<S: Simd, const K: usize, const D: usize>(
        &self,
        x: [&Stages; D],
        s: usize,
        y: [&mut Stages; D],
        start: &impl Fn(usize, usize) -> Lanes<S>,
        r: usize,
    ) -> usize {
        let mut even: [[_; K]; D] = from_fn(|d| from_fn(|i| start(d, r + i)));
        let mut odd = [[Lanes::<S>::splat(0.0); K]; D];
        for pair in 0..s.min(MOST).div_ceil(2) {
            let (k, l) = (2 * pair, 2 * pair + 1);
            for d in 0..D {
                let (a, b) = (Lanes::splat(x[d].0[k]), Lanes::splat(x[d].0[l]));
                for i in 0..K {
                    even[d][i] = self.0[k].block(r + i).mul_add(a, even[d][i]);
                    odd[d][i] = self.0[l].block(r + i).mul_add(b, odd[d][i]);
                }
            }
        }
        for (y, (even, odd)) in y.into_iter().zip(even.iter().zip(&odd)) {
            for i in 0..K {
                y.set(r + i, even[i] + odd[i]);
            }
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
