//! What is provably dissipated along a motion: the energy of an autonomous system.

use crate::numbers::state_words::saved;
use crate::run::Plan;
use crate::run::accuracy::noise::Noise;
use crate::{Stepper, legendre_inverse};
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, PhasePoint, VelocityPoint, gradient_rounding, max_or_nan};

/// The shortest distance of two looks in long runs, in steps: a look costs about three of the cheapest.
const APART: usize = 256;

/// The looks of a run beside those at powers of two.
const LOOKS: usize = 32;

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
/// use discrete_herglotz::{EnergyDrift, EnergyLook};
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

/// Watches the [drift](EnergyDrift) of the energy `H = p.v - L` along a run.
pub(crate) struct EnergyMonitor<const N: usize> {
    /// `L_z`, where the logarithm of sigma is this times the time, and the run does not count it.
    rate: Option<f64>,
    every: usize,
    guess: SVector<f64, N>,
    pub drift: EnergyDrift,
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

/// An energy with what a drift of it is compared with.
struct Energies {
    total: f64,
    kinetic: f64,
    /// The size of its terms.
    terms: f64,
}

impl<const N: usize> EnergyMonitor<N> {
    /// That of a run, where its energy and its conformal factor are known.
    pub fn of<L: Lagrangian<N>>(plan: &Plan<'_, L, N>) -> Option<Self> {
        let problem = plan.problem;
        let structure = &problem.structure;
        let known = plan.constant_rate || structure.has_constant_rate() || plan.needs.conformal_factor;
        if plan.error().is_some() || !structure.autonomous || !known || !(structure.z_free || plan.needs.action) {
            return None;
        }
        let Energies { total, kinetic, terms } =
            energies(problem.lagrangian, problem.t0, &problem.start, &problem.state)?;
        let counted = plan.constant_rate || plan.needs.conformal_factor;
        let rate = (!counted).then(|| problem.lagrangian.gradient(problem.t0, &problem.start).z);
        let start = EnergyLook { total, kinetic, terms, log_factor: 0.0, taken: 0 };
        Some(EnergyMonitor {
            rate,
            every: APART.max(plan.count.div_ceil(LOOKS)),
            guess: problem.start.v,
            drift: EnergyDrift::new(plan.info.order, &start),
        })
    }

    /// The number of steps after which it looks next.
    pub fn next(&self, taken: usize) -> usize {
        let doubled = (taken + 1).checked_next_power_of_two().unwrap_or(usize::MAX);
        doubled.min((taken / self.every + 1) * self.every).max(self.drift.first())
    }

    /// Looks at a state: its drift, in units of the largest that steps have which resolve their motion, where that is above one.
    pub fn look<L: Lagrangian<N>>(
        &mut self,
        plan: &Plan<'_, L, N>,
        stepper: &dyn Stepper<N>,
        (log_factor, taken): (f64, usize),
    ) -> Option<f64> {
        let (t, state) = (stepper.time(), &stepper.state());
        let problem = plan.problem;
        if taken < self.drift.first() {
            return None;
        }
        let guess = stepper.last_velocity().unwrap_or(self.guess);
        let x = legendre_inverse(problem.lagrangian, t, state, &guess).ok()?;
        let Energies { total, kinetic, terms } = energies(problem.lagrangian, t, &x, state)?;
        let log_factor = self.rate.map_or(log_factor, |rate| rate * (t - problem.t0));
        self.guess = x.v;
        let start = (problem.t0, &problem.start, &problem.state);
        self.drift.defect(&EnergyLook { total, kinetic, terms, log_factor, taken }, |sigma| {
            rounding_of(problem.lagrangian, t, &x, state)
                + rounding_of(problem.lagrangian, start.0, start.1, start.2) * sigma
                + Noise::at(problem.lagrangian, t, &x).energy
        })
    }
}

/// The part of a drift that is flagged in a run, from which on a look at its ends alone sees that it may be one: a drift that comes and goes
/// is that small at an end by chance in one of some twenty members.
const MAY: f64 = 0.05;

/// Whether the energy of a run of a system that does not depend on time, with a constant `L_z`, may have drifted, by its two ends: an
/// [`EnergyMonitor`] decides.
pub(crate) fn may_drift<L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    order: u32,
    (t0, from): (f64, &PhasePoint<N>),
    (t, to): (f64, &PhasePoint<N>),
) -> bool {
    let rest = SVector::zeros();
    let Ok(x) = legendre_inverse(lagrangian, t0, from, &rest) else { return false };
    let Ok(y) = legendre_inverse(lagrangian, t, to, &x.v) else { return false };
    let sigma = (lagrangian.gradient(t0, &x).z * (t - t0)).exp();
    let (Some(a), Some(b)) = (energies(lagrangian, t0, &x, from), energies(lagrangian, t, &y, to)) else {
        return false;
    };
    let allowed = allowed(f64::from(order.max(1))) * max_or_nan(a.kinetic * sigma, b.kinetic);
    (b.total - a.total * sigma).abs() > MAY * allowed
}

/// The drift, relative to the kinetic energy, that a method of an order may have.
fn allowed(order: f64) -> f64 {
    max_or_nan(LEAST, STEP.powf(order))
}

/// The energy at a state, with the kinetic one, `v.Wv/2`.
fn energies<L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    t: f64,
    x: &VelocityPoint<N>,
    state: &PhasePoint<N>,
) -> Option<Energies> {
    let (l, slope) = (lagrangian.value(t, &x.q, &x.v, x.z), lagrangian.gradient(t, x).z);
    let w = lagrangian.mass_matrix(t, x);
    let mut kinetic = 0.0;
    for i in 0..N {
        for j in 0..N {
            kinetic += 0.5 * (x.v[i] * w[(i, j)] * x.v[j]).abs();
        }
    }
    let total = state.p.dot(&x.v) - l;
    let terms = l.abs() + (slope * x.z).abs();
    (total.is_finite() && kinetic.is_finite() && terms.is_finite()).then_some(Energies { total, kinetic, terms })
}

/// What rounding may have changed of the energy at a state.
#[cold]
#[inline(never)]
fn rounding_of<L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    t: f64,
    x: &VelocityPoint<N>,
    state: &PhasePoint<N>,
) -> f64 {
    let (of_value, of_gradient) = gradient_rounding(lagrangian, t, x);
    let of_momentum = |i: usize| (f64::EPSILON * state.p[i] * x.v[i]).abs() + (of_gradient.y[i] * x.v[i]).abs();
    of_value + (0..N).map(of_momentum).sum::<f64>()
}
