//! The stage equations for constant mass and constant rate, condensed to the positions.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use super::{Inhomogeneity, LinearStages, StageTangent, add, add_product, add_scaled, product};
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{StageMap, Stages, blocks};
use crate::sensitivity::step_maps::StepMaps;
use contact_geom::nalgebra::DMatrix;
use pulp::Simd;

/// The maps of a step for constant mass and constant rate, where L is separable and there is no force: with
/// `a = W^-1 P'`, the positions are `q = q_without_a + A (1/rho) A a`; z and r are images of their terms without rates.
pub(super) struct CondensedMaps {
    pub(super) inverse_mass: DMatrix<f64>,
    pub(super) positions: StageMap,
    pub(super) z: StageMap,
    pub(super) r: StageMap,
}

impl LinearStages {
    /// Solves the equations for constant mass and rate by fixed-point iteration for the positions; `false` if it does
    /// not converge.
    #[inline(always)]
    pub(super) fn solve_condensed<S: Simd>(
        &mut self,
        condensed: &CondensedMaps,
        maps: &StepMaps,
        given: &Inhomogeneity,
        x: &mut StageTangent,
    ) -> bool {
        let (s, n) = (maps.s, self.l_v.len());
        let zero = Lanes::<S>::splat(0.0);
        let gamma = self.l_z.0[0];
        (x.r, x.r_rate) = (Stages::ZERO, Stages::ZERO);
        if given.has_r {
            let mut without = Stages::ZERO;
            maps.to_stages.apply::<S>(&given.r_source, s, &mut without, zero);
            for i in 0..MAX_STAGES {
                without.0[i] = given.r.0[i] - without.0[i];
            }
            condensed.r.apply::<S>(&without, s, &mut x.r, zero);
            for i in 0..MAX_STAGES {
                x.r_rate.0[i] = -gamma * x.r.0[i] - given.r_source.0[i];
            }
        }
        let (x_v, x_p_rate, x_q, x_p) = (&mut x.v[..n], &mut x.p_rate[..n], &mut x.q[..n], &mut x.p[..n]);
        let (momentum, fixed) = (&mut self.momentum[..n], &mut self.fixed_p_rate[..n]);
        let (q0, l_v) = (&mut self.fixed_q[..n], &self.l_v[..n]);
        let (given_q, given_p) = (&given.q[..n], &given.p[..n]);
        let (v_source, p_source, p_r) = (&given.v_source[..n], &given.p_source[..n], &self.p_r[..n]);
        let inverse = condensed.inverse_mass.as_slice();
        // The velocities without the rates of P, and the positions that they give.
        for d in 0..n {
            momentum[d] = without_r(&given_p[d], &v_source[d], &x.r, &l_v[d]);
        }
        for d in 0..n {
            let mut u = Stages::ZERO;
            for e in 0..n {
                add_product(&mut u, &momentum[e], &self.inverse_mass[(d, e)]);
            }
            maps.to_stages.apply::<S>(&u, s, &mut q0[d], &given_q[d]);
        }
        for d in 0..n {
            let mut rate = product(&x.r, &p_r[d]);
            add(&mut rate, &p_source[d]);
            fixed[d] = rate;
        }
        let mut iteration = FixedPointIteration::until(1.0, 0.25);
        // The first rates are a guess that does not belong to the positions before it.
        let unchecked = 1 + std::mem::take(&mut self.unchecked);
        for count in 1_u32.. {
            let (mut change, mut size) = (zero, zero);
            for d in 0..n {
                let mut a = Stages::ZERO;
                for e in 0..n {
                    add_scaled(&mut a, inverse[e * n + d], &x_p_rate[e]);
                }
                let mut q = Stages::ZERO;
                condensed.positions.apply::<S>(&a, s, &mut q, &q0[d]);
                for r in 0..blocks::<S>(s) {
                    let new = q.block::<S>(r);
                    change = change.max((new - x_q[d].block::<S>(r)).abs());
                    size = size.max(new.abs());
                }
                x_q[d] = q;
            }
            for d in 0..n {
                let mut rate = fixed[d];
                for e in 0..n {
                    add_product(&mut rate, &x_q[e], &self.p_q[(d, e)]);
                }
                x_p_rate[d] = rate;
            }
            if count <= unchecked {
                continue;
            }
            let (change, size) = (change.reduce_max(), size.reduce_max());
            match iteration.assess(change, size) {
                IterationOutcome::Continue => {}
                IterationOutcome::Done => {
                    // The next step converges as this one does: two changes show that it has.
                    self.unchecked = count.saturating_sub(3);
                    break;
                }
                _ => return false,
            }
        }
        for d in 0..n {
            maps.to_stages.apply::<S>(&x_p_rate[d], s, &mut x_p[d], &given_p[d]);
            momentum[d] = without_r(&x_p[d], &v_source[d], &x.r, &l_v[d]);
        }
        let mut z_rate = given.z_source;
        for d in 0..n {
            let mut v = Stages::ZERO;
            for e in 0..n {
                add_product(&mut v, &momentum[e], &self.inverse_mass[(d, e)]);
            }
            x_v[d] = v;
            add_product(&mut z_rate, &x_q[d], &self.z_q[d]);
            add_product(&mut z_rate, &x_v[d], &l_v[d]);
        }
        let mut without = Stages::ZERO;
        maps.to_stages.apply::<S>(&z_rate, s, &mut without, &given.z);
        condensed.z.apply::<S>(&without, s, &mut x.z, zero);
        for i in 0..MAX_STAGES {
            z_rate.0[i] += gamma * x.z.0[i];
        }
        x.z_rate = z_rate;
        // The maxima over lanes may hide a NaN.
        x.is_finite::<S>(s)
    }
}

/// `rho W v` at the stages: the momenta without the sources of the velocities and without the terms of r.
#[inline(always)]
fn without_r(p: &Stages, v_source: &Stages, r: &Stages, l_v: &Stages) -> Stages {
    let mut momentum = *p;
    for i in 0..MAX_STAGES {
        momentum.0[i] -= v_source.0[i] + r.0[i] * l_v.0[i];
    }
    momentum
}
