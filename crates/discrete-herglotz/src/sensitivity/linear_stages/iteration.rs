//! The fixed-point iteration for the stage equations.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use super::{Inhomogeneity, LinearStages, StageTangent, add, add_product, product, subtract_product};
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use crate::sensitivity::stage_derivatives::stage_values;
use crate::sensitivity::step_maps::StepMaps;
use pulp::Simd;

/// The rates that an iteration determines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Kinds {
    pub motion: bool,
    pub z: bool,
    pub r: bool,
}

impl LinearStages {
    /// Fixed-point iteration to round-off; `false` if it does not converge.
    #[inline(always)]
    pub(super) fn iterate<S: Simd>(
        &mut self,
        kinds: Kinds,
        maps: &StepMaps,
        given: &Inhomogeneity,
        x: &mut StageTangent,
    ) -> bool {
        let mut iteration = FixedPointIteration::until(1.0, 0.25);
        loop {
            match iteration.assess(self.update::<S>(kinds, maps, Some(given), x), 1.0) {
                IterationOutcome::Continue => {}
                IterationOutcome::Done => return x.is_finite::<S>(maps.s),
                _ => return false,
            }
        }
    }

    /// Computes the values at the stages from the rates, and the rates from these values; without the inhomogeneous
    /// terms, if none are given. Returns the largest change of a rate, relative to the size of the terms; it may hide a NaN.
    #[inline(always)]
    pub(super) fn update<S: Simd>(
        &mut self,
        kinds: Kinds,
        maps: &StepMaps,
        given: Option<&Inhomogeneity>,
        x: &mut StageTangent,
    ) -> f64 {
        let Kinds { motion, z, r } = kinds;
        let (s, n) = (maps.s, self.l_v.len());
        if r {
            x.r = summed::<S>(maps, &x.r_rate, given.map(|g| &g.r));
        }
        if z {
            x.z = summed::<S>(maps, &x.z_rate, given.map(|g| &g.z));
        }
        let (x_v, x_q) = (&mut x.v[..n], &mut x.q[..n]);
        let l_v = &self.l_v[..n];
        let mut worst = 0.0;
        if motion {
            let (x_p, x_p_rate, momentum) = (&mut x.p[..n], &mut x.p_rate[..n], &mut self.momentum[..n]);
            let (p_r, p_z, v_z) = (&self.p_r[..n], &self.p_z[..n], &self.v_z[..n]);
            for d in 0..n {
                x_q[d] = summed::<S>(maps, &x_v[d], given.map(|g| &g.q[d]));
            }
            for d in 0..n {
                let mut rate = product(&x.r, &p_r[d]);
                if self.coupled {
                    add_product(&mut rate, &x.z, &p_z[d]);
                }
                for e in 0..n {
                    add_product(&mut rate, &x_q[e], &self.p_q[(d, e)]);
                    if self.has_velocity_terms {
                        add_product(&mut rate, &x_v[e], &self.p_v[(d, e)]);
                    }
                }
                if let Some(given) = given {
                    add(&mut rate, &given.p_source[d]);
                }
                x_p_rate[d] = rate;
                x_p[d] = summed::<S>(maps, &rate, given.map(|g| &g.p[d]));
            }
            for d in 0..n {
                let mut of_v = x_p[d];
                subtract_product(&mut of_v, &x.r, &l_v[d]);
                if self.coupled {
                    subtract_product(&mut of_v, &x.z, &v_z[d]);
                }
                if self.has_velocity_terms {
                    for e in 0..n {
                        subtract_product(&mut of_v, &x_q[e], &self.v_q[(d, e)]);
                    }
                }
                if let Some(given) = given {
                    let source = &given.v_source[d];
                    for i in 0..MAX_STAGES {
                        of_v.0[i] -= source.0[i];
                    }
                }
                momentum[d] = of_v;
            }
            let mut changes = Changes::<S>::new();
            for d in 0..n {
                let mut v = Stages::ZERO;
                for e in 0..n {
                    add_product(&mut v, &momentum[e], &self.inverse_mass[(d, e)]);
                }
                changes.add(s, [&v, &x_v[d]], &x_q[d]);
                x_v[d] = v;
            }
            worst = changes.relative(maps);
        }
        let (mut z_rate, mut r_rate) = (Stages::ZERO, Stages::ZERO);
        if z {
            let z_q = &self.z_q[..n];
            z_rate = product(&x.z, &self.l_z);
            for d in 0..n {
                add_product(&mut z_rate, &x_q[d], &z_q[d]);
                add_product(&mut z_rate, &x_v[d], &l_v[d]);
            }
            if let Some(given) = given {
                add(&mut z_rate, &given.z_source);
            }
            let mut changes = Changes::<S>::new();
            changes.add(s, [&z_rate, &x.z_rate], &x.z);
            worst = f64::max(worst, changes.relative(maps));
        }
        if r {
            subtract_product(&mut r_rate, &x.r, &self.l_z);
            if motion {
                let (r_q, r_v) = (&self.r_q[..n], &self.r_v[..n]);
                subtract_product(&mut r_rate, &x.z, &self.r_z);
                for d in 0..n {
                    subtract_product(&mut r_rate, &x_q[d], &r_q[d]);
                    subtract_product(&mut r_rate, &x_v[d], &r_v[d]);
                }
            }
            if let Some(given) = given {
                for i in 0..MAX_STAGES {
                    r_rate.0[i] -= given.r_source.0[i];
                }
            }
            let mut changes = Changes::<S>::new();
            changes.add(s, [&r_rate, &x.r_rate], &x.r);
            worst = f64::max(worst, changes.relative(maps));
        }
        if z {
            x.z_rate = z_rate;
        }
        if r {
            x.r_rate = r_rate;
        }
        worst
    }
}

/// The values at the stages from their rates, with inhomogeneous terms where there are some.
#[inline(always)]
fn summed<S: Simd>(maps: &StepMaps, rates: &Stages, start: Option<&Stages>) -> Stages {
    let mut values = stage_values::<S>(maps, rates, 0.0);
    if let Some(start) = start {
        add(&mut values, start);
    }
    values
}

/// The largest change and the largest size of numbers at the stages. Maxima over lanes may hide a NaN.
struct Changes<S: Simd> {
    change: Lanes<S>,
    size: Lanes<S>,
    /// The largest of the values of which the numbers are the rates.
    value: Lanes<S>,
}

impl<S: Simd> Changes<S> {
    #[inline(always)]
    fn new() -> Self {
        let zero = Lanes::splat(0.0);
        Changes { change: zero, size: zero, value: zero }
    }

    #[inline(always)]
    fn add(&mut self, s: usize, [new, old]: [&Stages; 2], values: &Stages) {
        for r in 0..blocks::<S>(s) {
            let new = new.block::<S>(r);
            self.change = self.change.max((new - old.block(r)).abs());
            self.size = self.size.max(new.abs());
            self.value = self.value.max(values.block::<S>(r).abs());
        }
    }

    /// The change relative to the size of the terms; 0 where both vanish.
    #[inline(always)]
    fn relative(&self, maps: &StepMaps) -> f64 {
        let change = self.change.reduce_max();
        let size = f64::max(self.size.reduce_max(), self.value.reduce_max() / maps.h.abs());
        if change == 0.0 { 0.0 } else { change / size }
    }
}
