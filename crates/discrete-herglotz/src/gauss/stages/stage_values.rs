//! The values of a Lagrangian at the stages of a condensed step.

use crate::gauss::tables::condensed::Condensed;
use crate::numbers::lanes::Lanes;
use crate::numbers::pair::{Registers, over_registers};
use crate::numbers::registers::{Scaled, Stages, blocks};
use contact_geom::{Lagrangian, vector};
use pulp::{Simd, WithSimd};

/// The stages of a solved condensed step.
pub(crate) struct CondensedStages<'a> {
    pub table: &'a Condensed,
    /// The time and the velocity at the start of the step.
    pub t: f64,
    pub v0: &'a [f64],
    /// The accelerations and the positions.
    pub a: &'a [Stages],
    pub x: &'a [Stages],
    /// The velocities, which are computed.
    pub v: &'a mut [Stages],
}

/// The kernel that computes the velocities at the stages of a step, and evaluates `L(t, q, v, 0)` there.
pub(crate) struct StageValues<'a, L, const N: usize> {
    pub lagrangian: &'a L,
    pub solved: CondensedStages<'a>,
}

impl<L: Lagrangian<N>, const N: usize> WithSimd for StageValues<'_, L, N> {
    type Output = Stages;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Stages {
        let StageValues { lagrangian, solved: CondensedStages { table, t, v0, a, x, v } } = self;
        let (s, v) = (table.s, &mut v[..N]);
        for ((v, a), v0) in v.iter_mut().zip(&a[..N]).zip(&v0[..N]) {
            table.d.apply(a, s, v, Scaled(&table.inverse_rho, Lanes::<S>::splat(*v0)));
        }
        let stages = At::<L, N> { lagrangian, t, times: &table.times, x: &x[..N], v };
        let (mut values, mut r, m) = (Stages::ZERO, 0, blocks::<S>(s));
        while r < m {
            r = over_registers!(stages.take(r, &mut values); L::HINTS.interpreted, S, m - r);
        }
        values
    }
}

/// The points at which L is evaluated.
struct At<'a, L, const N: usize> {
    lagrangian: &'a L,
    t: f64,
    times: &'a Stages,
    x: &'a [Stages],
    v: &'a [Stages],
}

impl<L: Lagrangian<N>, const N: usize> At<'_, L, N> {
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
