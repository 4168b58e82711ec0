//! The energy of an autonomous system, which decays with the conformal factor along the exact motion.

use crate::resolution::thresholds::MIN_SUSPECT_DRIFT;
use crate::run::accuracy::equilibrium_round_off::EquilibriumRoundOff;
use crate::run::checks::energy_drift::{EnergyDrift, EnergySample, allowed};
use crate::run::discretization::Discretization;
use crate::system::AtState;
use crate::{Point, State, Stepper, System, Vector};
use contact_geom::numbers::max_or_nan;

/// The shortest distance of two energy checks in long runs, in steps: a check costs about three of the least expensive
/// steps.
const MIN_STEPS_BETWEEN_CHECKS: usize = 256;

/// The largest number of energy checks of a run in addition to those at powers of two: a drift that grows is then found
/// within a few hundredths of the run.
const MAX_REGULAR_CHECKS: usize = 32;

/// Monitors the [drift](EnergyDrift) of the energy `H = p.v - L` along a run.
pub(crate) struct EnergyMonitor {
    /// `L_z`, if it is constant and the run does not accumulate the conformal factor: `ln sigma` is then `L_z` times
    /// the time.
    rate: Option<f64>,
    every: usize,
    guess: Vector,
    pub drift: EnergyDrift,
}

/// An energy, and the quantities with which its drift is compared.
struct Energies {
    total: f64,
    kinetic: f64,
    /// The sum of the magnitudes of the terms `L` and `L_z z`.
    terms: f64,
}

impl EnergyMonitor {
    /// The monitor of a run, if its energy and its conformal factor are available.
    pub fn of(steps: &Discretization<'_>, constant_rate: bool) -> Option<Self> {
        let problem = &steps.problem;
        let structure = &problem.structure;
        let known = constant_rate || structure.has_constant_rate() || steps.needs.conformal_factor;
        if steps.error.is_some() || !structure.autonomous || !known || !(structure.z_free || steps.needs.action) {
            return None;
        }
        let system = &*problem.system;
        let Energies { total, kinetic, terms } = energies(system, problem.t0, &problem.start, &problem.state)?;
        let counted = constant_rate || steps.needs.conformal_factor;
        let rate = || system.at_state(problem.t0, &problem.state, &problem.start.v).map(|at| at.rate);
        let rate = if counted { None } else { Some(rate().ok()?) };
        let start = EnergySample { total, kinetic, terms, log_factor: 0.0, taken: 0 };
        Some(EnergyMonitor {
            rate,
            every: MIN_STEPS_BETWEEN_CHECKS.max(steps.count.div_ceil(MAX_REGULAR_CHECKS)),
            guess: problem.start.v.clone(),
            drift: EnergyDrift::new(steps.info.order, &start),
        })
    }

    /// The number of steps after which the next check is due.
    pub fn next(&self, taken: usize) -> usize {
        let doubled = (taken + 1).checked_next_power_of_two().unwrap_or(usize::MAX);
        doubled.min((taken / self.every + 1) * self.every).max(self.drift.first())
    }

    /// The drift at a state, relative to the largest drift of steps that resolve their motion, if this ratio exceeds
    /// one.
    pub fn drift(
        &mut self,
        steps: &Discretization<'_>,
        stepper: &dyn Stepper,
        (log_factor, taken): (f64, usize),
    ) -> Option<f64> {
        let (t, state) = (stepper.time(), &stepper.state());
        let (problem, system) = (&steps.problem, &*steps.problem.system);
        if taken < self.drift.first() {
            return None;
        }
        let near = stepper.last_velocity();
        let v = steps.velocity_near(t, state, near.as_ref().unwrap_or(&self.guess)).ok()?;
        let x = Point { q: state.q.clone(), v, z: state.z };
        let Energies { total, kinetic, terms } = energies(system, t, &x, state)?;
        let log_factor = self.rate.map_or(log_factor, |rate| rate * (t - problem.t0));
        let drift = self.drift.defect(&EnergySample { total, kinetic, terms, log_factor, taken }, |sigma| {
            rounding_of(system, t, &x, state)
                + rounding_of(system, problem.t0, &problem.start, &problem.state) * sigma
                + EquilibriumRoundOff::at(system, t, &x).energy
        });
        self.guess = x.v;
        drift
    }
}

/// Whether the energy of a run may have drifted, judged from its two ends, for an autonomous system with constant
/// `L_z`. The decision is left to an [`EnergyMonitor`].
pub(crate) fn may_drift(system: &dyn System, order: u32, (t0, from): (f64, &State), (t, to): (f64, &State)) -> bool {
    let rest = Vector::zeros(system.dimension());
    let Ok(x) = system.legendre_inverse(t0, from, &rest) else { return false };
    let Ok(y) = system.legendre_inverse(t, to, &x.v) else { return false };
    let Ok(AtState { rate, .. }) = system.at_state(t0, from, &x.v) else { return false };
    let sigma = (rate * (t - t0)).exp();
    let (Some(a), Some(b)) = (energies(system, t0, &x, from), energies(system, t, &y, to)) else {
        return false;
    };
    let allowed = allowed(f64::from(order.max(1))) * max_or_nan(a.kinetic * sigma, b.kinetic);
    (b.total - a.total * sigma).abs() > MIN_SUSPECT_DRIFT * allowed
}

/// The energy at a state, with the kinetic energy `v.Wv/2` as the sum of the magnitudes of its terms.
fn energies(system: &dyn System, t: f64, x: &Point, state: &State) -> Option<Energies> {
    let (n, mut kinetic) = (system.dimension(), 0.0);
    let (l, slope);
    if system.hints().hamiltonian {
        AtState { l, rate: slope, .. } = system.at_state(t, state, &x.v).ok()?;
        // The mass matrix need not exist.
        kinetic = (0..n).map(|i| 0.5 * (state.p[i] * x.v[i]).abs()).sum();
    } else {
        (l, slope) = (system.value(t, x), system.gradient(t, x).z);
        let w = system.mass_matrix(t, x);
        for i in 0..n {
            for j in 0..n {
                kinetic += 0.5 * (x.v[i] * w[(i, j)] * x.v[j]).abs();
            }
        }
    }
    let total = state.p.dot(&x.v) - l;
    let terms = l.abs() + (slope * x.z).abs();
    (total.is_finite() && kinetic.is_finite() && terms.is_finite()).then_some(Energies { total, kinetic, terms })
}

/// A bound on the round-off of the energy at a state.
#[cold]
#[inline(never)]
fn rounding_of(system: &dyn System, t: f64, x: &Point, state: &State) -> f64 {
    let (of_value, of_gradient) = system.rounding_at_state(t, x, state);
    let of_momentum = |i: usize| (f64::EPSILON * state.p[i] * x.v[i]).abs() + (of_gradient.y[i] * x.v[i]).abs();
    of_value + (0..system.dimension()).map(of_momentum).sum::<f64>()
}
