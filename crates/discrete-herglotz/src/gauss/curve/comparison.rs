//! The comparison of a curve with L and its gradient at the sample points.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::curve::Curve;
use crate::gauss::curve::between::PointSets;
use crate::gauss::curve::sample::Sample;
use crate::gauss::resolution::defect_sample::{DefectSample, beyond_rounding, tail, weighted};
use crate::gauss::tables::coefficients::Coefficients;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::blocks;
use contact_geom::Scalar;
use contact_geom::numbers::max_or_nan;
use pulp::{Simd, WithSimd};

/// The defect of a curve from its sample.
pub(super) struct Compare<'a> {
    pub curve: &'a Curve,
    pub sample: &'a Sample,
    pub transformed: bool,
    /// Whether the Lagrangian is given by a contact Hamiltonian.
    pub hamiltonian: bool,
    pub sets: PointSets,
}

impl WithSimd for Compare<'_> {
    type Output = DefectSample;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> DefectSample {
        let Compare { curve, sample, transformed, hamiltonian, sets } = self;
        let Curve { s, h, .. } = *curve;
        let (n, zero) = (curve.q.len(), Lanes::<S>::splat(0.0));
        let (mut of_value, mut kinetic, mut largest_l) = (zero, zero, zero);
        let (mut defect, mut size, mut of_z, mut size_z, mut all) = (zero, zero, zero, zero, zero);
        let (mut of_v, mut size_v) = (zero, zero);
        for r in 0..blocks::<S>(sample.between.count) {
            // The factors from transformed time to t.
            let (mut slower, mut long) = (Lanes::<S>::splat(1.0), Lanes::<S>::splat(h));
            if transformed {
                let rate = sample.dt_dtau.block::<S>(r);
                (slower, long) = (rate.recip(), long * rate);
            }
            let inverse = (Lanes::<S>::splat(1.0) - sample.one_minus_rho.block::<S>(r)).recip();
            let (value, slope, at_z) = (sample.value.block::<S>(r), sample.slope.block::<S>(r), sample.z.block::<S>(r));
            let mut work = zero;
            let drag = (sample.rate.block::<S>(r) * inverse * slower - slope) * long;
            for d in 0..n {
                let mut v = sample.v[d].block::<S>(r);
                if transformed {
                    v *= slower;
                }
                let p = sample.y[d].block::<S>(r) * inverse;
                let force = sample.f[d].block::<S>(r) * inverse * h;
                let of_force = p.mul_add(drag, force - sample.force[d].block::<S>(r) * long);
                // For a Hamiltonian, `H_p` is compared with the velocity.
                let of_momentum = if hamiltonian {
                    let of_velocity = v - sample.momentum[d].block::<S>(r);
                    of_v = of_v.max(of_velocity.abs());
                    size_v = size_v.max(v.abs());
                    defect = defect.max(of_force.abs());
                    of_velocity
                } else {
                    let of_momentum = p - sample.momentum[d].block::<S>(r);
                    defect = defect.max(of_force.abs()).max(of_momentum.abs());
                    of_momentum
                };
                size = size.max(p.abs()).max(force.abs());
                all += of_force * 0.0 + of_momentum * 0.0;
                // The terms of `p . v` may cancel: where H decays, as by `H_z > 0`, and is linear in p, `p . v` decays with
                // it while the momenta do not. The action of a Hamiltonian has the round-off of the terms.
                work = if hamiltonian { work + (p * v).abs() } else { p.mul_add(v, work) };
            }
            let apart = sample.l.block::<S>(r) * slower - value;
            of_value = of_value.max(apart.abs());
            kinetic = kinetic.max(work.abs() + (slope * at_z).abs());
            largest_l = largest_l.max(value.abs());
            if hamiltonian {
                largest_l = largest_l.max(work);
            }
            all += apart * 0.0;
            if curve.acts {
                of_z = of_z.max((apart * long).abs());
                size_z = size_z.max(at_z.abs()).max((value * long).abs());
                if hamiltonian {
                    // An action may vanish by cancellation of `p . v` and H.
                    size_z = size_z.max((work * long).abs());
                }
            }
        }
        // The maximum over lanes may hide a NaN. In `all` every value is multiplied by 0, which leaves a NaN for a NaN
        // or an infinity.
        if all.sum() != 0.0 {
            return DefectSample {
                defect: f64::INFINITY,
                of_momenta: f64::INFINITY,
                of_action: f64::INFINITY,
                of_value: f64::INFINITY,
                ..DefectSample::default()
            };
        }
        let relative = |defect: f64, size: f64| if defect > 0.0 { defect / size } else { 0.0 };
        let (mut size, size_z) = (size.reduce_max(), size_z.reduce_max());
        let (mut of_momenta, of_action) = (defect.reduce_max(), of_z.reduce_max());
        if hamiltonian {
            // The defect of the velocities in the units of the momenta, or of the velocities where all momenta are 0.
            let (of_v, size_v) = (of_v.reduce_max(), size_v.reduce_max());
            if size == 0.0 {
                size = size_v;
            }
            of_momenta = max_or_nan(of_momenta, relative(of_v, size_v) * size);
        }
        let defect = relative(of_momenta, size) + relative(of_action, size_z);
        let of_value = beyond_rounding(of_value.reduce_max(), largest_l.reduce_max());
        // The coefficients do not depend on the sample points; set 0 alone returns the estimate from them.
        if sets != PointSets::One(0) {
            return DefectSample { defect, of_momenta, of_action, of_value, ..DefectSample::default() };
        }
        let mut fastest = 0.0;
        for v in &sample.v {
            for v in v.0 {
                fastest = max_or_nan(fastest, v.abs());
            }
        }
        let g = Coefficients::of(s);
        let mut expected = tail(g, &curve.rate) * h;
        for d in 0..n {
            expected += relative(tail(g, &curve.force[d]) * h, size) + relative(tail(g, &curve.v[d]), fastest);
        }
        if curve.acts {
            expected += relative(tail(g, &curve.l) * h, size_z);
        }
        let mut ends = [0.0; 2];
        for i in 0..2 {
            ends[i] = weighted(&g.ends[i], &curve.l) / curve.rates[i];
        }
        DefectSample {
            defect,
            of_momenta,
            of_action,
            size,
            size_z,
            expected,
            of_value,
            kinetic: kinetic.reduce_max(),
            ends,
            follows_a_jump: false,
        }
    }
}
