//! Values at the stages of a collocation step, and linear maps between them, in SIMD registers.

use crate::numbers::array::from_fn;
use crate::numbers::compensated::Unevaluated;
use crate::numbers::lanes::Lanes;
use crate::numbers::state_words::Saved;
use pulp::Simd;
use qd::Quad;

/// The largest number of stages.
pub(crate) const MAX_STAGES: usize = 16;

/// One number for each stage, padded to whole registers. The padding repeats the last stage, so that formulas that are
/// regular at the stages are regular there too, or it is multiplied by 0.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct Stages(pub [f64; MAX_STAGES]);

impl Stages {
    pub const ZERO: Stages = Stages([0.0; MAX_STAGES]);

    pub fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        Stages(self.0.map(f))
    }

    #[inline(always)]
    pub fn block<S: Simd>(&self, r: usize) -> Lanes<S> {
        // The double negation marks the value as a number; otherwise the compiler may move it as bytes, in halves.
        -(-Lanes(S::as_simd_f64s(&self.0).0[r]))
    }

    #[inline(always)]
    pub fn set<S: Simd>(&mut self, r: usize, x: Lanes<S>) {
        S::as_mut_simd_f64s(&mut self.0).0[r] = x.0;
    }

    /// Sets K registers from the r-th on.
    #[inline(always)]
    pub fn set_group<S: Simd, const K: usize>(&mut self, r: usize, x: [Lanes<S>; K]) {
        for (i, x) in x.into_iter().enumerate() {
            self.set(r + i, x);
        }
    }

    /// The sum over the stages, for values with padding 0.
    #[inline(always)]
    pub fn sum<S: Simd>(&self, s: usize) -> f64 {
        let mut sum = Lanes::<S>::splat(0.0);
        for r in 0..blocks::<S>(s) {
            sum += self.block(r);
        }
        sum.sum()
    }
}

/// The number of registers that hold `s` stages.
#[inline(always)]
pub(crate) fn blocks<S: Simd>(s: usize) -> usize {
    s.div_ceil(Lanes::<S>::COUNT)
}

/// One double-double number for each stage, padded with 0.
pub(crate) type DoubleDoubleStages = [Quad; MAX_STAGES];

/// The heads of double-double numbers for the stages; the last one is repeated in the padding.
pub(crate) fn padded(x: &DoubleDoubleStages, s: usize) -> Stages {
    Stages(from_fn(|i| x[i.min(s - 1)].0))
}

/// Double-double weights of the stages, padded with 0.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights {
    head: Stages,
    tail: Stages,
}

impl Weights {
    pub fn new(x: &DoubleDoubleStages) -> Self {
        Weights { head: Stages(x.map(|w| w.0)), tail: Stages(x.map(|w| w.1)) }
    }

    /// The weighted sum over the stages.
    #[inline(always)]
    pub fn sum<S: Simd>(&self, x: &Stages, s: usize) -> Unevaluated {
        let mut head = Lanes::<S>::splat(0.0);
        let mut tail = Lanes::<S>::splat(0.0);
        for r in 0..blocks::<S>(s) {
            head = self.head.block(r).mul_add(x.block(r), head);
            tail = self.tail.block(r).mul_add(x.block(r), tail);
        }
        Unevaluated { head: head.sum(), tail: tail.sum() }
    }
}

/// Repeats an expression for all registers of the stages, in groups of K = 4, 2 and 1 registers from the r-th on.
macro_rules! over_groups {
    ($s:ident, $blocks:expr, $r:ident, $k:ident => $work:expr) => {
        over_groups!($s, $blocks, $r, $k at most 4 => $work)
    };
    ($s:ident, $blocks:expr, $r:ident, $k:ident at most $most:literal => $work:expr) => {{
        let (blocks, mut at) = ($blocks, 0);
        while const { $most >= 4 && 4 * $s::F64_LANES <= $crate::numbers::registers::MAX_STAGES } && at + 4 <= blocks {
            const $k: usize = 4;
            let $r = at;
            $work;
            at += $k;
        }
        while at + 2 <= blocks {
            const $k: usize = 2;
            let $r = at;
            $work;
            at += $k;
        }
        if at < blocks {
            const $k: usize = 1;
            let $r = at;
            $work;
        }
    }};
}

pub(crate) use over_groups;

/// The terms to which a product is added. They are no closures, which may be compiled as separate functions without vector
/// instructions.
pub(crate) trait Terms<S: Simd>: Copy {
    /// The r-th register.
    fn register(self, r: usize) -> Lanes<S>;

    /// K registers from the r-th on.
    #[inline(always)]
    fn group<const K: usize>(self, r: usize) -> [Lanes<S>; K] {
        let mut group = [Lanes::splat(0.0); K];
        for (i, lanes) in group.iter_mut().enumerate() {
            *lanes = self.register(r + i);
        }
        group
    }
}

/// The same number at all stages.
impl<S: Simd> Terms<S> for Lanes<S> {
    #[inline(always)]
    fn register(self, _r: usize) -> Lanes<S> {
        self
    }
}

impl<S: Simd> Terms<S> for &Stages {
    #[inline(always)]
    fn register(self, r: usize) -> Lanes<S> {
        self.block(r)
    }
}

/// Values at the stages times a number.
#[derive(Clone, Copy)]
pub(crate) struct Scaled<'a, S: Simd>(pub &'a Stages, pub Lanes<S>);

impl<S: Simd> Terms<S> for Scaled<'_, S> {
    #[inline(always)]
    fn register(self, r: usize) -> Lanes<S> {
        self.0.block(r) * self.1
    }
}

/// A linear map between stage values, by columns.
#[derive(Clone, Debug)]
pub(crate) struct StageMap(pub [Stages; MAX_STAGES]);

impl StageMap {
    /// The map with the given rows.
    pub fn new(rows: &[[f64; MAX_STAGES]; MAX_STAGES], s: usize) -> Self {
        StageMap(from_fn(|j| Stages(from_fn(|i| rows[i.min(s - 1)][j]))))
    }

    pub fn from_exact(rows: &[DoubleDoubleStages; MAX_STAGES], s: usize) -> Self {
        Self::new(&rows.map(|row| row.map(|e| e.0)), s)
    }

    /// `y = start + M x`.
    #[inline(always)]
    pub fn apply<S: Simd>(&self, x: &Stages, s: usize, y: &mut Stages, start: impl Terms<S>) {
        self.apply_rows(x, s, s, y, start);
    }

    /// The same for another number of rows than of stages of x.
    #[inline(always)]
    pub fn apply_rows<S: Simd>(&self, x: &Stages, s: usize, rows: usize, y: &mut Stages, start: impl Terms<S>) {
        over_groups!(S, blocks::<S>(rows), r, K => {
            let [sums] = self.rows::<S, K, 1>([x], s, [start.group(r)], r);
            y.set_group(r, sums);
        });
    }

    /// `y += M x`.
    #[inline(always)]
    pub fn add<S: Simd>(&self, x: &Stages, s: usize, y: &mut Stages) {
        over_groups!(S, blocks::<S>(s), r, K => {
            let mut start = [Lanes::<S>::splat(0.0); K];
            for (i, lanes) in start.iter_mut().enumerate() {
                *lanes = y.block(r + i);
            }
            let [sums] = self.rows::<S, K, 1>([x], s, [start], r);
            y.set_group(r, sums);
        });
    }

    /// `y_d = start_d + M x_d` for several vectors, two at a time, so that the matrix is loaded half as often. The results
    /// are bitwise those of [`apply`](Self::apply).
    #[inline(always)]
    pub fn apply_to_each<S: Simd>(&self, x: &[Stages], s: usize, y: &mut [Stages], start: &[Stages]) {
        for (i, (x, y)) in x.chunks(2).zip(y.chunks_mut(2)).enumerate() {
            match (x, y) {
                ([a, b], [c, d]) => over_groups!(S, blocks::<S>(s), r, K at most 2 => {
                    let starts = [(&start[2 * i]).group(r), (&start[2 * i + 1]).group(r)];
                    let [first, second] = self.rows::<S, K, 2>([a, b], s, starts, r);
                    c.set_group(r, first);
                    d.set_group(r, second);
                }),
                ([a], [c]) => self.apply::<S>(a, s, c, &start[2 * i]),
                _ => {}
            }
        }
    }

    /// `start_d + M x_d` for D vectors, in the K registers from the r-th on.
    ///
    /// Even and odd columns are summed separately, so that more independent sums overlap the latency of the
    /// multiplications.
    #[inline(always)]
    pub fn rows<S: Simd, const K: usize, const D: usize>(
        &self,
        x: [&Stages; D],
        s: usize,
        start: [[Lanes<S>; K]; D],
        r: usize,
    ) -> [[Lanes<S>; K]; D] {
        let (mut even, mut odd) = (start, [[Lanes::<S>::splat(0.0); K]; D]);
        for pair in 0..s.min(MAX_STAGES).div_ceil(2) {
            let (k, l) = (2 * pair, 2 * pair + 1);
            for d in 0..D {
                let (a, b) = (Lanes::splat(x[d].0[k]), Lanes::splat(x[d].0[l]));
                for i in 0..K {
                    even[d][i] = self.0[k].block(r + i).mul_add(a, even[d][i]);
                    odd[d][i] = self.0[l].block(r + i).mul_add(b, odd[d][i]);
                }
            }
        }
        for d in 0..D {
            for i in 0..K {
                even[d][i] += odd[d][i];
            }
        }
        even
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
