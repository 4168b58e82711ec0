//! Checks of the solved stages of a general step: whether they satisfy their equations, and whether the step resolves
//! the motion.

use crate::gauss::dense::Solved;
use crate::gauss::limits::MAX_UNCHECKED_FACTOR_CHANGE;
use crate::gauss::resolution::tail::of_sigma;
use crate::gauss::routes::general::General;
use crate::gauss::stages::parametrization::Parametrization;
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::numbers::array::from_fn;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use crate::resolution::monitor::value_rounding;
use crate::resolution::thresholds::{COLLOCATION_ROUNDINGS, MIN_CHECKED_CHANGE};
use crate::solve::mass_matrix::{inverted, kept_mass_matrix};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, VelocityPoint, numbers::max_or_nan, support::gradient_rounding};
use pulp::Simd;

impl<L: Lagrangian<N>, P: Parametrization<N>, const N: usize> General<'_, L, P, N> {
    /// Sets the defect of the last step. `first` is the relative error of its predictor; the stages are checked only if
    /// it is large, and the conformal factor also if it changes strongly.
    #[inline(always)]
    pub(crate) fn assess_resolution<S: Simd>(&mut self, first: f64) {
        self.defect = 0.0;
        if first > MIN_CHECKED_CHANGE {
            let rates = if const { P::PHYSICAL } { None } else { Some(&self.extension.g) };
            self.defect = self.tail.defect::<S>(&self.v, rates, &self.x, self.table.h);
        }
        if first > MIN_CHECKED_CHANGE || self.one_minus_rho.abs() > MAX_UNCHECKED_FACTOR_CHANGE {
            let one = Lanes::<S>::splat(1.0);
            let mut integral = Lanes::<S>::splat(0.0);
            for r in 0..blocks::<S>(self.table.s) {
                integral += self.rate.block::<S>(r) / (one - self.one_minus_rho_stages.block(r));
            }
            self.defect = max_or_nan(self.defect, of_sigma(1.0 / (1.0 - self.one_minus_rho), integral.sum()));
        }
    }

    /// Whether the stages satisfy their equations to round-off although the velocities still change. This occurs if W
    /// is ill conditioned, and near an equilibrium, where the round-off of a force is that of its cancelling terms.
    #[cold]
    #[inline(never)]
    pub(crate) fn holds<S: Simd>(&self, t: f64) -> bool {
        let (s, i) = (self.table.s, self.table.s / 2);
        let (q, v) = (SVector::from_fn(|d, _| self.x[d].0[i]), SVector::from_fn(|d, _| self.v[d].0[i]));
        let x = VelocityPoint { q, v, z: self.z_stages.0[i] };
        let (of_value, once) = gradient_rounding(self.lagrangian, t + self.table.times.0[i], &x);
        // Compares `start + M rates` with `sums`, relative to the terms of the sum.
        let holds = |start: f64, rates: &Stages, rounding: f64, sums: &dyn Fn(usize) -> f64| {
            let mut sum = Stages::ZERO;
            self.table.m.apply(rates, s, &mut sum, Lanes::<S>::splat(0.0));
            (0..s).all(|i| {
                let terms = (0..s).fold(start.abs(), |m, j| m + (self.table.m.0[j].0[i] * rates.0[j]).abs());
                let off = start + sum.0[i] - sums(i);
                off.abs()
                    <= max_or_nan(
                        8.0 * f64::EPSILON * max_or_nan(terms, sums(i).abs()),
                        COLLOCATION_ROUNDINGS * rounding,
                    )
            })
        };
        let rho = self.one_minus_rho_stages.map(|one_minus_rho_stages| 1.0 - one_minus_rho_stages);
        let of_action = value_rounding(of_value, once.x.as_slice(), x.q.as_slice()) * self.table.h.abs();
        let of_momentum = |d: usize| once.x[d] * self.table.h.abs() + once.y[d];
        holds(1.0, &self.rate.map(|rate| -rate), 0.0, &|i| rho.0[i])
            && holds(self.z.value, &self.l, of_action, &|i| self.z_stages.0[i])
            && (0..N).all(|d| holds(self.p[d].value, &self.force[d], of_momentum(d), &|i| rho.0[i] * self.l_v[d].0[i]))
    }

    /// Inverts W at one stage after another, on the heap; `false` if it is singular.
    #[inline(never)]
    pub(crate) fn invert_one_by_one(&mut self, t: f64) -> bool {
        (0..self.table.s).all(|i| {
            let (q, v) = (SVector::from_fn(|d, _| self.x[d].0[i]), SVector::from_fn(|d, _| self.v[d].0[i]));
            let x = VelocityPoint { q, v, z: self.z_stages.0[i] };
            let w = kept_mass_matrix(self.lagrangian, t + self.table.times.0[i], &x);
            inverted(&w).is_ok_and(|inverse| {
                self.mass.keep(i, &inverse);
                true
            })
        })
    }

    /// The stages of the last step, for dense output.
    pub fn solved(&self) -> Solved<N> {
        Solved {
            v: self.v.map(|v| v.0),
            force: from_fn(|d| self.unweighted(&self.force[d])),
            rate: self.unweighted(&self.rate),
            l: self.unweighted(&self.l),
        }
    }

    /// The stages of the last step in transformed time, with `g V` for the velocities.
    pub fn solved_in_transformed_time(&self) -> Solved<N> {
        Solved { v: from_fn(|d| self.unweighted(&self.moved[d])), ..self.solved() }
    }

    /// Divides stage values by the weights, and pads them with 0.
    #[inline(always)]
    fn unweighted(&self, x: &Stages) -> [f64; MAX_STAGES] {
        let mut values = [0.0; MAX_STAGES];
        for i in 0..self.table.s.min(MAX_STAGES) {
            values[i] = x.0[i] / self.table.weights.0[i];
        }
        values
    }
}
