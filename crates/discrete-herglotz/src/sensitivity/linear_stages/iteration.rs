//! The fixed-point iteration for the stage equations.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use super::{Inhomogeneity, LinearStages, StageTangent, add, add_product, product, subtract_product};
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::numbers::registers::Stages;
use crate::sensitivity::stage_derivatives::stage_values;
use crate::sensitivity::step_maps::StepMaps;
use contact_geom::numbers::max_or_nan;
use pulp::Simd;

/// The rates that an iteration determines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Kinds {
    pub motion: bool,
    pub z: bool,
    pub r: bool,
}

impl<const N: usize> LinearStages<N> {
    /// Fixed-point iteration to round-off; `false` if it does not converge.
    #[inline(always)]
    pub(super) fn iterate<S: Simd>(
        &self,
        kinds: Kinds,
        maps: &StepMaps,
        given: &Inhomogeneity<N>,
        x: &mut StageTangent<N>,
    ) -> bool {
        let mut iteration = FixedPointIteration::until(1.0, 0.25);
        loop {
            match iteration.assess(self.update::<S>(kinds, maps, Some(given), x), 1.0) {
                IterationOutcome::Continue => {}
                IterationOutcome::Done => return true,
                _ => return false,
            }
        }
    }

    /// Computes the values at the stages from the rates, and the rates from these values; without the inhomogeneous
    /// terms, if none are given. Returns the largest change of a rate, relative to the size of the terms.
    #[inline(always)]
    pub(super) fn update<S: Simd>(
        &self,
        kinds: Kinds,
        maps: &StepMaps,
        given: Option<&Inhomogeneity<N>>,
        x: &mut StageTangent<N>,
    ) -> f64 {
        let Kinds { motion, z, r } = kinds;
        let s = maps.s;
        if r {
            x.r = summed::<S>(maps, &x.r_rate, given.map(|g| &g.r));
        }
        if z {
            x.z = summed::<S>(maps, &x.z_rate, given.map(|g| &g.z));
        }
        let mut worst = 0.0;
        if motion {
            for d in 0..N {
                x.q[d] = summed::<S>(maps, &x.v[d], given.map(|g| &g.q[d]));
            }
            for d in 0..N {
                let mut rate = product(&x.r, &self.p_r[d]);
                if self.coupled {
                    add_product(&mut rate, &x.z, &self.p_z[d]);
                }
                for e in 0..N {
                    add_product(&mut rate, &x.q[e], &self.p_q[d][e]);
                    if self.has_velocity_terms {
                        add_product(&mut rate, &x.v[e], &self.p_v[d][e]);
                    }
                }
                if let Some(given) = given {
                    add(&mut rate, &given.p_source[d]);
                }
                x.p_rate[d] = rate;
                x.p[d] = summed::<S>(maps, &x.p_rate[d], given.map(|g| &g.p[d]));
            }
            let mut momentum = [Stages::ZERO; N];
            for d in 0..N {
                momentum[d] = x.p[d];
                subtract_product(&mut momentum[d], &x.r, &self.l_v[d]);
                if self.coupled {
                    subtract_product(&mut momentum[d], &x.z, &self.v_z[d]);
                }
                if self.has_velocity_terms {
                    for e in 0..N {
                        subtract_product(&mut momentum[d], &x.q[e], &self.v_q[d][e]);
                    }
                }
                if let Some(given) = given {
                    for i in 0..MAX_STAGES {
                        momentum[d].0[i] -= given.v_source[d].0[i];
                    }
                }
            }
            let (mut change, mut size, mut length) = (0.0, 0.0, 0.0);
            for d in 0..N {
                let mut v = Stages::ZERO;
                for e in 0..N {
                    add_product(&mut v, &momentum[e], &self.inverse_mass[d][e]);
                }
                compare(s, &v, &x.v[d], &mut change, &mut size);
                let mut none = 0.0;
                compare(s, &x.q[d], &x.q[d], &mut none, &mut length);
                x.v[d] = v;
            }
            worst = relative(change, max_or_nan(size, length / maps.h.abs()));
        }
        let (mut z_rate, mut r_rate) = (Stages::ZERO, Stages::ZERO);
        if z {
            z_rate = product(&x.z, &self.l_z);
            for d in 0..N {
                add_product(&mut z_rate, &x.q[d], &self.z_q[d]);
                add_product(&mut z_rate, &x.v[d], &self.l_v[d]);
            }
            if let Some(given) = given {
                add(&mut z_rate, &given.z_source);
            }
            worst = max_or_nan(worst, apart(maps, &z_rate, &x.z_rate, &x.z));
        }
        if r {
            subtract_product(&mut r_rate, &x.r, &self.l_z);
            if motion {
                subtract_product(&mut r_rate, &x.z, &self.r_z);
                for d in 0..N {
                    subtract_product(&mut r_rate, &x.q[d], &self.r_q[d]);
                    subtract_product(&mut r_rate, &x.v[d], &self.r_v[d]);
                }
            }
            if let Some(given) = given {
                for i in 0..MAX_STAGES {
                    r_rate.0[i] -= given.r_source.0[i];
                }
            }
            worst = max_or_nan(worst, apart(maps, &r_rate, &x.r_rate, &x.r));
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

/// The largest difference and the largest value at the stages; infinite where one is NaN.
#[inline(always)]
fn compare(s: usize, new: &Stages, old: &Stages, change: &mut f64, size: &mut f64) {
    for i in 0..s {
        *change = max_or_nan(*change, (new.0[i] - old.0[i]).abs());
        *size = max_or_nan(*size, new.0[i].abs());
    }
}

/// A change relative to a size; 0 where both vanish.
#[inline(always)]
fn relative(change: f64, size: f64) -> f64 {
    if change == 0.0 { 0.0 } else { change / size }
}

/// The relative change of the rates of values at the stages.
#[inline(always)]
fn apart(maps: &StepMaps, new: &Stages, old: &Stages, values: &Stages) -> f64 {
    let (mut change, mut size, mut none, mut length) = (0.0, 0.0, 0.0, 0.0);
    compare(maps.s, new, old, &mut change, &mut size);
    compare(maps.s, values, values, &mut none, &mut length);
    relative(change, max_or_nan(size, length / maps.h.abs()))
}
