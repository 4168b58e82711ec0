//! Fixed-point iteration of the general step.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::routes::general::vectors::Vectors;
use crate::gauss::stages::changes::Changes;
use crate::gauss::stages::mass_matrix::InverseMass;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::compensated::CompensatedSum;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{StageMap, Stages, blocks, over_groups};
use contact_geom::nalgebra::SVector;
use contact_geom::{Scalar, vector};
use pulp::Simd;

/// The kinds of variables whose changes are compared: velocities, integrating factors and actions.
const KINDS: usize = 3;

/// The iteration of a step for N coordinates: the fields of [`General`](super::General) of the same names.
pub(crate) struct Iteration<'k, const N: usize, const TRANSFORMED: bool> {
    pub m: &'k StageMap,
    pub table: &'k StageTable,
    pub vectors: Vectors<'k>,
    pub l: &'k mut Stages,
    pub rate: &'k mut Stages,
    pub one_minus_rho_stages: &'k mut Stages,
    pub z_stages: &'k mut Stages,
    pub g: &'k mut Stages,
    pub p_t: f64,
    pub inverse: InverseMass<'k>,
    pub follows: bool,
    pub q: &'k [CompensatedSum],
    pub p: &'k [CompensatedSum],
    pub z: f64,
}

impl<const N: usize, const TRANSFORMED: bool> Iteration<'_, N, TRANSFORMED> {
    /// One fixed-point iteration: computes new velocities, positions, actions and factors of the stages. Returns the
    /// largest change of velocities, factors and actions, each kind relative to its largest value.
    ///
    /// Intermediate results stay in registers until they are used, since a round trip through memory is slower. The
    /// code uses loops: closures may be compiled as separate functions without vector instructions.
    #[inline(always)]
    pub(crate) fn iterate<S: Simd>(&mut self) -> f64 {
        let (zero, one) = (Lanes::<S>::splat(0.0), Lanes::splat(1.0));
        let mut seen = Changes::compared_with([zero, one, zero]);
        over_groups!(S, blocks::<S>(self.table.s), r, K at most 2 => self.push::<S, K>(r, &mut seen));
        over_groups!(S, blocks::<S>(self.table.s), r, K at most 2 => self.move_stages::<S, K>(r, &mut seen));
        let change = seen.relative(0).max(seen.relative(1));
        let of_action = seen.relative(2);
        // `f64::max` would hide a NaN.
        if of_action > change || of_action.is_nan() { of_action } else { change }
    }

    /// Computes the factors and velocities of the stages in K registers from the r-th on.
    #[inline(always)]
    fn push<S: Simd, const K: usize>(&mut self, r: usize, seen: &mut Changes<S, KINDS>) {
        let Vectors { v, l_v, moved, force, .. } = &mut self.vectors;
        let (s, zero, one) = (self.table.s, Lanes::<S>::splat(0.0), Lanes::<S>::splat(1.0));
        let (mut one_minus_rho_stages, mut pushed) = ([zero; K], [[zero; K]; N]);
        for d in 0..N {
            let mut p = [Lanes::splat(self.p[d].value); K];
            for k in 0..K {
                p[k] -= l_v[d].block(r + k);
            }
            if d == 0 {
                [one_minus_rho_stages, pushed[0]] = self.m.rows([&*self.rate, &force[0]], s, [[zero; K], p], r);
            } else {
                [pushed[d]] = self.m.rows([&force[d]], s, [p], r);
            }
        }
        for k in 0..K {
            let (r, one_minus_rho_stages) = (r + k, one_minus_rho_stages[k]);
            let (before, rho) = (self.one_minus_rho_stages.block::<S>(r), one - one_minus_rho_stages);
            seen.see(1, one_minus_rho_stages - before, rho);
            self.one_minus_rho_stages.set(r, one_minus_rho_stages);
            let inverse = rho.recip();
            let excess: SVector<Lanes<S>, N> =
                vector!(|d| l_v[d].block::<S>(r).mul_add(one_minus_rho_stages, pushed[d][k]));
            let mut weight = self.table.weights.block::<S>(r);
            if const { TRANSFORMED } {
                weight *= self.g.block(r);
            }
            for i in 0..N {
                let mut change = zero;
                for j in 0..N {
                    change = (self.inverse.entry::<S>(N, i, j, r) * inverse).mul_add(excess[j], change);
                }
                let to = v[i].block::<S>(r) + change;
                seen.see(0, change, to);
                v[i].set(r, to);
                moved[i].set(r, weight * to);
            }
        }
    }

    /// Computes the positions and actions of the stages in K registers from the r-th on.
    #[inline(always)]
    fn move_stages<S: Simd, const K: usize>(&mut self, r: usize, seen: &mut Changes<S, KINDS>) {
        let Vectors { l_v, moved, x, .. } = &mut self.vectors;
        let s = self.table.s;
        let mut z = [Lanes::<S>::splat(self.z); K];
        for d in 0..N {
            let mut to = [Lanes::<S>::splat(self.q[d].value); K];
            if d == 0 {
                [z, to] = self.m.rows([&*self.l, &moved[0]], s, [z, to], r);
            } else {
                [to] = self.m.rows([&moved[d]], s, [to], r);
            }
            for k in 0..K {
                if self.follows {
                    z[k] = l_v[d].block::<S>(r + k).mul_add(to[k] - x[d].block(r + k), z[k]);
                }
                x[d].set(r + k, to[k]);
            }
        }
        for k in 0..K {
            seen.see(2, z[k] - self.z_stages.block(r + k), z[k]);
            self.z_stages.set(r + k, z[k]);
        }
    }
}
