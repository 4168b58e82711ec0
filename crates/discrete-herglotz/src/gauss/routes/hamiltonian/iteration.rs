//! Fixed-point iteration of a step: the right-hand sides at the stages, and the stages of given right-hand sides.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::routes::hamiltonian::rows::Rows;
use crate::gauss::stages::changes::Changes;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::compensated::CompensatedSum;
use crate::numbers::lanes::Lanes;
use crate::numbers::pair::{Registers, over_registers, register};
use crate::numbers::registers::{blocks, over_groups};
use contact_geom::{ChartVector, Lagrangian, PhasePoint, Scalar, VelocityPoint, vector};
use pulp::Simd;

/// The iteration of a step for N coordinates: the fields of [`HamiltonianStages`](super::HamiltonianStages) of the same
/// names.
pub(super) struct Iteration<'k, L, const N: usize> {
    pub lagrangian: &'k L,
    pub table: &'k StageTable,
    pub rows: Rows<'k, N>,
    pub q: &'k [CompensatedSum; N],
    pub p: &'k [CompensatedSum; N],
    pub z: f64,
    /// `H_pp`, by columns.
    pub pp: &'k [f64],
    pub least: [f64; 2],
}

/// The kinds of variables whose changes are compared with their largest values.
const KINDS: usize = 4;

impl<L: Lagrangian<N>, const N: usize> Iteration<'_, L, N> {
    /// Computes momenta, factors, positions and actions of the stages from the right-hand sides. Returns the largest change
    /// of each kind relative to its largest value. An action that vanishes by cancellation, as that of a Hamiltonian of
    /// degree one in p, is as large as `h p . v` in this comparison.
    ///
    /// With `predict`, the velocities follow the new momenta by `H_pp` at an earlier state, before the positions are
    /// computed: for a motion with kinetic energy an iteration then reduces the error by `(h omega)^2` instead of
    /// `h omega`. The actions follow the new positions by `dZ = p dQ`. Neither changes the solution.
    #[inline(always)]
    pub(super) fn move_stages<S: Simd>(&mut self, predict: bool) -> f64 {
        let (zero, one) = (Lanes::<S>::splat(0.0), Lanes::splat(1.0));
        let [p, z] = self.least.map(Lanes::splat);
        let mut seen = Changes::compared_with([zero, p, z, one]);
        over_groups!(S, blocks::<S>(self.table.s), r, K at most 2 => self.push::<S, K>(r, predict, &mut seen));
        over_groups!(S, blocks::<S>(self.table.s), r, K at most 2 => self.move_group::<S, K>(r, predict, &mut seen));
        seen.largest()
    }

    /// The factors, momenta and predicted velocities of the stages in K registers from the r-th on.
    #[inline(always)]
    fn push<S: Simd, const K: usize>(&mut self, r: usize, predict: bool, seen: &mut Changes<S, KINDS>) {
        let (m, s, zero) = (self.table.m, self.table.s, Lanes::<S>::splat(0.0));
        let [one_minus_rho] = m.rows([&*self.rows.rate], s, [[zero; K]], r);
        let mut inverse = [zero; K];
        for k in 0..K {
            seen.see(3, one_minus_rho[k] - self.rows.one_minus_rho.block(r + k), zero);
            self.rows.one_minus_rho.set(r + k, one_minus_rho[k]);
            inverse[k] = (Lanes::splat(1.0) - one_minus_rho[k]).recip();
        }
        let mut changes = [[zero; K]; N];
        for d in 0..N {
            let p = Lanes::splat(self.p[d].value);
            let [pushed] = m.rows([&self.rows.force[d]], s, [[p; K]], r);
            for k in 0..K {
                let p = pushed[k] * inverse[k];
                changes[d][k] = p - self.rows.p[d].block(r + k);
                seen.see(1, changes[d][k], p);
                seen.see(2, zero, p * self.rows.v[d].block(r + k) * self.table.h);
                self.rows.p[d].set(r + k, p);
            }
        }
        if !predict {
            return;
        }
        for k in 0..K {
            let weight = self.table.weights.block::<S>(r + k);
            for i in 0..N {
                let mut change = zero;
                for j in 0..N {
                    change = Lanes::<S>::splat(self.pp[j * N + i]).mul_add(changes[j][k], change);
                }
                let moved = self.rows.moved[i].block::<S>(r + k);
                self.rows.moved[i].set(r + k, weight.mul_add(change, moved));
            }
        }
    }

    /// The positions and actions of the stages in K registers from the r-th on.
    #[inline(always)]
    fn move_group<S: Simd, const K: usize>(&mut self, r: usize, predict: bool, seen: &mut Changes<S, KINDS>) {
        let (m, s) = (self.table.m, self.table.s);
        let start = Lanes::<S>::splat(self.z);
        let [mut z] = m.rows([&*self.rows.l], s, [[start; K]], r);
        for d in 0..N {
            let q = Lanes::<S>::splat(self.q[d].value);
            let [x] = m.rows([&self.rows.moved[d]], s, [[q; K]], r);
            for k in 0..K {
                let change = x[k] - self.rows.x[d].block(r + k);
                seen.see(0, change, x[k]);
                if predict {
                    z[k] = self.rows.p[d].block::<S>(r + k).mul_add(change, z[k]);
                }
                self.rows.x[d].set(r + k, x[k]);
            }
        }
        for k in 0..K {
            seen.see(2, z[k] - self.rows.z.block(r + k), z[k]);
            self.rows.z.set(r + k, z[k]);
        }
    }

    /// Evaluates H and its gradient at the stages, and from them the right-hand sides.
    #[inline(always)]
    pub(super) fn evaluate<S: Simd>(&mut self, t: f64) {
        let m = blocks::<S>(self.table.s);
        let mut r = 0;
        while r < m {
            r = over_registers!(self.take_gradients(t, r); L::HINTS.interpreted, S, m - r);
        }
    }

    /// The same at the blocks of stages that T holds, from the r-th on; returns the index of the next block.
    #[inline(always)]
    fn take_gradients<S: Simd, T: Registers<S>>(&mut self, t: f64, r: usize) -> usize {
        let point = PhasePoint {
            q: vector!(|d| T::of(&self.rows.x[d], r)),
            p: vector!(|d| T::of(&self.rows.p[d], r)),
            z: T::of(self.rows.z, r),
        };
        let time = T::of(&self.table.times, r) + t;
        // `None` only for a Lagrangian that is not given by a Hamiltonian, which has no such steps.
        let Some((h, mut d)) = self.lagrangian.hamiltonian_with_gradient(time, &point) else { return r + T::COUNT };
        if const { L::HINTS.forced } {
            let x = VelocityPoint { q: point.q, v: d.y, z: point.z };
            d.x -= self.lagrangian.applied_force(time, &x);
        }
        for i in 0..T::COUNT {
            self.weigh(
                r + i,
                h.register(i),
                &ChartVector { x: register(&d.x, i), y: register(&d.y, i), z: d.z.register(i) },
            );
        }
        r + T::COUNT
    }

    /// Stores the right-hand sides at one block of stages, multiplied by the weights.
    #[inline(always)]
    fn weigh<S: Simd>(&mut self, r: usize, h: Lanes<S>, d: &ChartVector<N, Lanes<S>>) {
        let (weight, fallen) = (self.table.weights.block::<S>(r), self.rows.one_minus_rho.block::<S>(r));
        let mut l = -h;
        for i in 0..N {
            let (v, slope) = (d.y[i], d.x[i]);
            l = self.rows.p[i].block::<S>(r).mul_add(v, l);
            self.rows.v[i].set(r, v);
            self.rows.moved[i].set(r, weight * v);
            self.rows.force[i].set(r, weight * slope.mul_add(fallen, -slope));
        }
        self.rows.l.set(r, weight * l);
        self.rows.rate.set(r, weight * d.z.mul_add(fallen, -d.z));
    }
}
