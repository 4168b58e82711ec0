//! The stage equations for constant mass and constant rate, condensed to the positions.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use super::{Inhomogeneity, LinearStages, StageTangent, add, add_product, product};
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{StageMap, Stages, blocks};
use crate::sensitivity::step_maps::StepMaps;
use contact_geom::nalgebra::SMatrix;
use pulp::Simd;

/// The maps of a step for constant mass and constant rate, where L is separable and there is no force: with
/// `a = W^-1 P'`, the positions are `q = q_without_a + A (1/rho) A a`; z and r are images of their terms without rates.
pub(super) struct CondensedMaps<const N: usize> {
    pub(super) inverse_mass: SMatrix<f64, N, N>,
    pub(super) positions: StageMap,
    pub(super) z: StageMap,
    pub(super) r: StageMap,
}

impl<const N: usize> LinearStages<N> {
    /// Solves the equations for constant mass and rate by fixed-point iteration for the positions; `false` if it does
    /// not converge.
    #[inline(always)]
    pub(super) fn solve_condensed<S: Simd>(
        &self,
        condensed: &CondensedMaps<N>,
        maps: &StepMaps,
        given: &Inhomogeneity<N>,
        x: &mut StageTangent<N>,
    ) -> bool {
        let s = maps.s;
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
        // The velocities without the rates of P, and the positions that they give.
        let (mut u, mut q0) = ([Stages::ZERO; N], [Stages::ZERO; N]);
        for d in 0..N {
            let mut momentum = given.p[d];
            for i in 0..MAX_STAGES {
                momentum.0[i] -= given.v_source[d].0[i] + x.r.0[i] * self.l_v[d].0[i];
            }
            for e in 0..N {
                add_product(&mut u[e], &momentum, &self.inverse_mass[e][d]);
            }
        }
        for d in 0..N {
            maps.to_stages.apply::<S>(&u[d], s, &mut q0[d], &given.q[d]);
        }
        let mut fixed = [Stages::ZERO; N];
        for d in 0..N {
            fixed[d] = product(&x.r, &self.p_r[d]);
            add(&mut fixed[d], &given.p_source[d]);
        }
        let (mut iteration, mut is_first) = (FixedPointIteration::until(1.0, 0.25), true);
        loop {
            let mut a = [Stages::ZERO; N];
            let (mut change, mut size) = (zero, zero);
            for d in 0..N {
                for e in 0..N {
                    for i in 0..MAX_STAGES {
                        a[d].0[i] += condensed.inverse_mass[(d, e)] * x.p_rate[e].0[i];
                    }
                }
                let mut q = Stages::ZERO;
                condensed.positions.apply::<S>(&a[d], s, &mut q, &q0[d]);
                for r in 0..blocks::<S>(s) {
                    let new = q.block::<S>(r);
                    change = change.max((new - x.q[d].block::<S>(r)).abs());
                    size = size.max(new.abs());
                }
                x.q[d] = q;
            }
            for d in 0..N {
                x.p_rate[d] = fixed[d];
                for e in 0..N {
                    add_product(&mut x.p_rate[d], &x.q[e], &self.p_q[d][e]);
                }
            }
            // The first rates are a guess that does not belong to the positions before it.
            if std::mem::take(&mut is_first) {
                continue;
            }
            let (change, size) = (change.reduce_max(), size.reduce_max());
            match iteration.assess(change, size) {
                IterationOutcome::Continue => {}
                IterationOutcome::Done => break,
                _ => return false,
            }
        }
        for d in 0..N {
            maps.to_stages.apply::<S>(&x.p_rate[d], s, &mut x.p[d], &given.p[d]);
        }
        let mut z_rate = given.z_source;
        let mut finite = 0.0;
        for d in 0..N {
            let mut v = Stages::ZERO;
            for e in 0..N {
                let mut momentum = x.p[e];
                for i in 0..MAX_STAGES {
                    momentum.0[i] -= given.v_source[e].0[i] + x.r.0[i] * self.l_v[e].0[i];
                }
                add_product(&mut v, &momentum, &self.inverse_mass[d][e]);
            }
            x.v[d] = v;
            add_product(&mut z_rate, &x.q[d], &self.z_q[d]);
            add_product(&mut z_rate, &x.v[d], &self.l_v[d]);
            for i in 0..s {
                finite += v.0[i] + x.q[d].0[i];
            }
        }
        let mut without = Stages::ZERO;
        maps.to_stages.apply::<S>(&z_rate, s, &mut without, &given.z);
        condensed.z.apply::<S>(&without, s, &mut x.z, zero);
        for i in 0..MAX_STAGES {
            z_rate.0[i] += gamma * x.z.0[i];
        }
        x.z_rate = z_rate;
        // The maxima over lanes may hide a NaN.
        finite.is_finite()
    }
}
