//! Detection of steps that do not resolve the motion, from the known evolution of the energy.

use crate::drag::Drag;
use crate::system::{AssembledSystem, State};
use contact_geom::numbers::max_or_nan;
use discrete_herglotz::{
    UnresolvedStep,
    checks::{EnergyDrift, EnergySample},
};

/// The number of steps between two energy checks in long runs. A check costs about five of the least expensive steps,
/// which is half a per cent of 1024 steps.
const APART: usize = 1024;

/// The maximum number of times at which a system is tested for dependence on time.
const TIMES: usize = 4096;

/// The error of `ln sigma_d` in a step above which the step does not resolve the drag; the same value as for Gauss
/// collocation on small systems.
const SIGMA: f64 = 0.1;

/// The property of the energy along a motion that is checked.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Known {
    /// `E_L` divided by the conformal factor is constant, if the system does not depend on time.
    Conserved,
    /// `T + V`, whose rate of change is `2 gamma T`, does not grow while the drag dissipates, if V does not depend on
    /// time. This is checked if the action is not computed, and if gamma depends on time.
    Bounded,
}

/// Checks the energy of a run after 4, 16, 64 and 256 steps, every 1024 steps, and on request.
#[derive(Clone, Debug)]
pub(crate) struct EnergyMonitor {
    /// `None` if no property of the energy is known, or if it was found not to hold.
    known: Option<(Known, EnergyDrift)>,
    /// The energy at the start, and the size of its terms.
    start: [f64; 2],
    t0: f64,
    looked: usize,
    unresolved: Option<UnresolvedStep>,
}

/// The total energy and the size of its parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Energies {
    /// `E_L`, or `T + V` if that is requested.
    pub total: f64,
    pub kinetic: f64,
    /// The sum of the absolute values of the other terms.
    pub terms: f64,
}

/// The point that a run has reached.
#[derive(Clone, Copy)]
pub(crate) struct Reached {
    pub t: f64,
    /// The logarithm of the conformal factor since the start.
    pub log_factor: f64,
    pub taken: usize,
}

/// Data of the steps of a run: the step size, `ln sigma_d` of the first step, and the order of the method.
#[derive(Clone, Copy)]
pub(crate) struct StepFacts {
    pub h: f64,
    pub log_sigma: f64,
    pub order: u32,
}

impl EnergyMonitor {
    /// The monitor of a run from `start`, with or without the action. `energies` returns the energies at the start; its
    /// argument requests `T + V` instead of `E_L`.
    pub fn new(
        system: &AssembledSystem,
        start: State,
        StepFacts { h, log_sigma, order }: StepFacts,
        energies: impl FnOnce(bool) -> Energies,
    ) -> Self {
        let general = !system.locals.is_empty();
        let (known, defect) = match &system.drag {
            _ if general => (Some(Known::Conserved), 0.0),
            Drag::Constant(gamma) => {
                let conserved = start.z.is_some() || *gamma == 0.0;
                let bounded = (gamma * h < 0.0).then_some(Known::Bounded);
                (if conserved { Some(Known::Conserved) } else { bounded }, (log_sigma - gamma * h).abs() / SIGMA)
            }
            Drag::Timed(_) => (Some(Known::Bounded), 0.0),
        };
        let mut monitor = EnergyMonitor {
            known: None,
            start: [0.0; 2],
            t0: start.t,
            looked: 0,
            unresolved: (defect > 1.0).then_some(UnresolvedStep { step: 0, defect }),
        };
        if let Some(known) = known {
            let Energies { kinetic, total, terms } = energies(known == Known::Bounded);
            if total.is_finite() && kinetic.is_finite() {
                let look = EnergySample { total, kinetic, terms, log_factor: 0.0, taken: 0 };
                monitor.known = Some((known, EnergyDrift::new(order, &look)));
                monitor.start = [total, kinetic + terms];
            }
        }
        monitor
    }

    /// Whether a check is due after `taken` steps.
    #[inline]
    pub fn is_due(&self, taken: usize) -> bool {
        let early = matches!(taken, 4 | 16 | 64 | 256);
        (early || taken.is_multiple_of(APART)) && self.tells(taken)
    }

    /// Whether a check after `taken` steps can give new information.
    pub fn tells(&self, taken: usize) -> bool {
        self.unresolved.is_none() && self.known.is_some() && taken > self.looked
    }

    /// The first unresolved step found so far.
    pub fn unresolved(&self) -> Option<UnresolvedStep> {
        self.unresolved
    }

    /// Checks the energy of a state. `energies` returns the energies of this state at a given time; its second argument
    /// requests `T + V` instead of `E_L`.
    pub fn look(
        &mut self,
        system: &AssembledSystem,
        reached: Reached,
        mut energies: impl FnMut(f64, bool) -> Energies,
    ) {
        let Some((known, drift)) = &mut self.known else { return };
        let Reached { t, log_factor, taken } = reached;
        let bounded = *known == Known::Bounded;
        let Energies { kinetic, total, terms } = energies(t, bounded);
        // A decrease of the bounded energy is not a drift.
        let [start, start_terms] = self.start;
        let (found, log_factor) = if bounded { (max_or_nan(total, start), 0.0) } else { (total, log_factor) };
        let look = EnergySample { total: found, kinetic, terms, log_factor, taken };
        let rounding = |sigma: f64| f64::EPSILON * (kinetic + terms + start_terms * sigma);
        self.looked = taken;
        let Some(defect) = drift.defect(&look, rounding) else { return };
        // The test for dependence on time uses the times of the steps, or `TIMES` equidistant times if there are more
        // steps.
        let span = t - self.t0;
        let times = taken.min(TIMES);
        let steady = (0..times).all(|i| {
            let s = self.t0 + span * (i as f64 / times as f64);
            let falls = !bounded || system.rate(s) * span <= 0.0;
            falls && energies(s, bounded).total.to_bits() == total.to_bits()
        });
        if steady {
            self.unresolved = Some(UnresolvedStep { step: taken - 1, defect });
        } else {
            self.known = None;
        }
    }
}
