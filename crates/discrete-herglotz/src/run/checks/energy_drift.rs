//! The drift of the energy of an autonomous system.

use crate::numbers::state_words::saved;
use crate::resolution::thresholds::{ENERGY_ROUNDINGS, FIRST_ORDER_STEPS, MAX_OSCILLATION_STEP, MIN_ALLOWED_DRIFT};
use contact_geom::numbers::max_or_nan;

/// The drift of the energy of an autonomous system along a run. The motion satisfies `dH/dt = L_z H`, so that `H/sigma`
/// is constant, with the conformal factor sigma. The drift is compared with the kinetic energy: the larger of its mean
/// over the checks so far, scaled by the conformal factor, and its value at the last check.
///
/// If the drag is strong within a step, H is a small difference of L and `L_z z`, whose errors are of their own size
/// times the drag of a step; these are added to the kinetic energy.
///
/// A [`Run`](crate::Run) checks the drift automatically. This type is for programs that take the steps of their own
/// systems:
///
/// ```
/// use discrete_herglotz::checks::{EnergyDrift, EnergySample};
/// let sample = |total: f64, taken: usize| EnergySample { total, kinetic: 0.5, terms: 0.5, log_factor: 0.0, taken };
/// let mut drift = EnergyDrift::new(2, &sample(1.0, 0));
/// assert_eq!(drift.defect(&sample(1.001, 100), |_| 0.0), None);
/// assert!(drift.defect(&sample(2.0, 200), |_| 0.0).is_some_and(|defect| defect > 1.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyDrift {
    start: f64,
    order: f64,
    pub(crate) sums: EnergySums,
}

/// The energy after a number of steps of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergySample {
    /// The energy `H`.
    pub total: f64,
    /// The kinetic energy, with which the drift is compared.
    pub kinetic: f64,
    /// The size of the terms `L` and `L_z z`.
    pub terms: f64,
    /// The logarithm of the conformal factor since the start.
    pub log_factor: f64,
    /// The number of steps taken.
    pub taken: usize,
}

impl EnergyDrift {
    /// The drift of a run with a method of the given order, from the energy at its start.
    pub fn new(order: u32, start: &EnergySample) -> Self {
        let sums = EnergySums { scale: start.kinetic, samples: 1.0, ..EnergySums::default() };
        EnergyDrift { start: start.total, order: f64::from(order.max(1)), sums }
    }

    /// The number of steps before which a check is inconclusive.
    pub fn first(&self) -> usize {
        FIRST_ORDER_STEPS.powf(1.0 / self.order).ceil() as usize
    }

    /// Makes a check; returns the drift relative to the largest drift of steps that resolve their motion, if this ratio
    /// exceeds one. `rounding` gives the round-off of the energies for a conformal factor since the start; it is called
    /// only if the result depends on it.
    pub fn defect(&mut self, at: &EnergySample, rounding: impl FnOnce(f64) -> f64) -> Option<f64> {
        let EnergySample { total, kinetic, terms, log_factor, taken } = *at;
        if taken < self.first() {
            return None;
        }
        let EnergySums { scale, samples, log_factor: before, taken: taken_before } = self.sums;
        let grown = log_factor - before;
        let in_a_step = (grown / (taken as f64 - taken_before)).abs();
        let size = kinetic + in_a_step * terms;
        let scale = scale * grown.exp() + size;
        self.sums = EnergySums { scale, samples: samples + 1.0, log_factor, taken: taken as f64 };
        let drift = (total - self.start * log_factor.exp()).abs();
        let allowed = allowed(self.order) * max_or_nan(scale / (samples + 1.0), size);
        if drift <= allowed || !drift.is_finite() || !allowed.is_finite() {
            return None;
        }
        // The round-off of all steps may accumulate.
        let rounding = (ENERGY_ROUNDINGS + taken as f64) * rounding(log_factor.exp());
        (drift > rounding).then(|| drift / max_or_nan(allowed, f64::MIN_POSITIVE))
    }
}

/// Sums over the checks so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct EnergySums {
    /// The sum of the energies with which a drift is compared, scaled by the conformal factor, and their number.
    pub scale: f64,
    pub samples: f64,
    /// The logarithm of the conformal factor, and the number of steps, at the last check.
    pub log_factor: f64,
    pub taken: f64,
}

saved!([] EnergySums { scale, samples, log_factor, taken });

/// The allowed drift of a method of the given order, relative to the kinetic energy.
pub(crate) fn allowed(order: f64) -> f64 {
    max_or_nan(MIN_ALLOWED_DRIFT, MAX_OSCILLATION_STEP.powf(order))
}
