//! The drift of a provably dissipated energy.

use crate::numbers::state_words::saved;
use contact_geom::numbers::max_or_nan;

/// The part of the kinetic energy by which the energy may be off: that of an oscillation by steps of half a radian, with the power of
/// the order; and at the least this, by which a frequency is off too, so that the phase is lost in some ten periods.
const STEP: f64 = 0.5;
const LEAST: f64 = 0.01;

/// In so many steps from rest the energy of a step's error, with the order one, is as large as the kinetic energy over their number.
const FIRST: f64 = 16.0;

/// The drift of the energy of an autonomous system along a run. The motion has `dH/dt = L_z H`, so that `H / sigma` is constant,
/// with the conformal factor sigma; what it drifts by is compared with the kinetic energy, the mean of the looks so far and that of
/// the last one, in the same units.
///
/// Where the drag is strong in a step H is a small difference of L and `L_z z`, whose errors are of their own size times the drag.
///
/// A [`Run`](crate::Run) looks at it by itself. This is for programs that take the steps of systems of their own:
///
/// ```
/// use discrete_herglotz::checks::{EnergyDrift, EnergyLook};
/// let look = |total: f64, taken: usize| EnergyLook { total, kinetic: 0.5, terms: 0.5, log_factor: 0.0, taken };
/// let mut drift = EnergyDrift::new(2, &look(1.0, 0));
/// assert_eq!(drift.defect(&look(1.001, 100), |_| 0.0), None);
/// assert!(drift.defect(&look(2.0, 200), |_| 0.0).is_some_and(|defect| defect > 1.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyDrift {
    start: f64,
    order: f64,
    pub(crate) sums: EnergySums,
}

/// An energy after some steps of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnergyLook {
    /// The energy `H`.
    pub total: f64,
    /// The kinetic energy, which a drift is compared with.
    pub kinetic: f64,
    /// The size of the terms `L` and `L_z z`.
    pub terms: f64,
    /// The logarithm of the conformal factor since the start.
    pub log_factor: f64,
    /// The steps taken.
    pub taken: usize,
}

impl EnergyDrift {
    /// Of a run by a method of an order, from its start.
    pub fn new(order: u32, start: &EnergyLook) -> Self {
        let sums = EnergySums { scale: start.kinetic, looks: 1.0, ..EnergySums::default() };
        EnergyDrift { start: start.total, order: f64::from(order.max(1)), sums }
    }

    /// The number of steps before which a look tells nothing.
    pub fn first(&self) -> usize {
        FIRST.powf(1.0 / self.order).ceil() as usize
    }

    /// Looks: the drift, in units of the largest that steps have which resolve their motion, where that is above one. What
    /// rounding may have changed of the energies is asked for by the conformal factor since the start, and only where it matters.
    pub fn defect(&mut self, at: &EnergyLook, rounding: impl FnOnce(f64) -> f64) -> Option<f64> {
        let EnergyLook { total, kinetic, terms, log_factor, taken } = *at;
        if taken < self.first() {
            return None;
        }
        let EnergySums { scale, looks, log_factor: before, taken: taken_before } = self.sums;
        let grown = log_factor - before;
        let in_a_step = (grown / (taken as f64 - taken_before)).abs();
        let size = kinetic + in_a_step * terms;
        let scale = scale * grown.exp() + size;
        self.sums = EnergySums { scale, looks: looks + 1.0, log_factor, taken: taken as f64 };
        let drift = (total - self.start * log_factor.exp()).abs();
        let allowed = allowed(self.order) * max_or_nan(scale / (looks + 1.0), size);
        if drift <= allowed || !drift.is_finite() || !allowed.is_finite() {
            return None;
        }
        // The roundings of all steps may add up.
        let rounding = (64.0 + taken as f64) * rounding(log_factor.exp());
        (drift > rounding).then(|| drift / max_or_nan(allowed, f64::MIN_POSITIVE))
    }
}

/// What the looks so far add up to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct EnergySums {
    /// The energies that a drift is compared with, damped as the energy is, and their number.
    pub scale: f64,
    pub looks: f64,
    /// The logarithm of the conformal factor, and the steps, at the last look.
    pub log_factor: f64,
    pub taken: f64,
}

saved!([] EnergySums { scale, looks, log_factor, taken });

/// The drift, relative to the kinetic energy, that a method of an order may have.
pub(crate) fn allowed(order: f64) -> f64 {
    max_or_nan(LEAST, STEP.powf(order))
}
