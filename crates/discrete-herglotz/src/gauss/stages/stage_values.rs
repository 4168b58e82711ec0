//! The values of a Lagrangian at the stages of a condensed step.

use crate::numbers::pair::{Registers, over_registers};
use crate::numbers::registers::{Stages, blocks};
use contact_geom::{Lagrangian, vector};
use pulp::{Simd, WithSimd};

/// The kernel that evaluates `L(t, q, v, 0)` at the s stages of a step that begins at the time t.
pub(crate) struct StageValues<'a, L, const N: usize> {
    pub lagrangian: &'a L,
    pub s: usize,
    pub t: f64,
    pub times: &'a Stages,
    pub x: &'a [Stages],
    pub v: &'a [Stages],
}

impl<L: Lagrangian<N>, const N: usize> WithSimd for StageValues<'_, L, N> {
    type Output = Stages;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Stages {
        let stages = StageValues::<L, N> { x: &self.x[..N], v: &self.v[..N], ..self };
        let (mut values, mut r, m) = (Stages::ZERO, 0, blocks::<S>(self.s));
        while r < m {
            r = over_registers!(stages.take(r, &mut values); L, S, m - r);
        }
        values
    }
}

impl<L: Lagrangian<N>, const N: usize> StageValues<'_, L, N> {
    /// Evaluates the blocks of stages that T holds, from the r-th on; returns the index of the next block.
    #[inline(always)]
    fn take<S: Simd, T: Registers<S>>(&self, r: usize, values: &mut Stages) -> usize {
        let (q, v) = (vector!(|d| T::of(&self.x[d], r)), vector!(|d| T::of(&self.v[d], r)));
        let l = self.lagrangian.value(T::of(self.times, r) + self.t, &q, &v, T::zero());
        for i in 0..T::COUNT {
            values.set(r + i, l.register(i));
        }
        r + T::COUNT
    }
}
