//! Whether steps resolve a motion, by the energy that is provably dissipated along it.

use crate::drag::Drag;
use crate::system::{AssembledSystem, State};
use contact_geom::max_or_nan;
use discrete_herglotz::{EnergyDrift, EnergyLook, UnresolvedStep};

/// The steps between two looks in long runs: one costs about five of the cheapest steps, half a per cent of them.
const APART: usize = 1024;

/// The times at which a system is asked whether it depends on them, at the most.
const TIMES: usize = 4096;

/// The error of `ln sigma_d` in a step from which on the step does not resolve the drag, as of Gauss collocation on small systems.
const SIGMA: f64 = 0.1;

/// What is known of the energy along a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Known {
    /// `E_L` over the conformal factor does not change, where the system does not depend on time.
    Conserved,
    /// `T + V` does not grow, where V does not depend on time: its rate is `2 gamma T`. It is looked at without the action, and where gamma
    /// depends on time.
    Bounded,
}

/// Looks at the energy of a run now and then: after 4, 16, 64 and 256 steps, every 1024, and where it is asked.
#[derive(Clone, Debug)]
pub(crate) struct EnergyMonitor {
    /// `None` where nothing is known, or was found not to hold.
    known: Option<(Known, EnergyDrift)>,
    /// The energy at the start, and the size of its terms.
    start: [f64; 2],
    t0: f64,
    looked: usize,
    unresolved: Option<UnresolvedStep>,
}

/// The parts of an energy.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Energies {
    /// `E_L`, or `T + V` where that is asked for.
    pub total: f64,
    pub kinetic: f64,
    /// The size of the other terms.
    pub terms: f64,
}

/// How far a run has come.
#[derive(Clone, Copy)]
pub(crate) struct Reached {
    pub t: f64,
    /// The logarithm of the conformal factor since the start.
    pub log_factor: f64,
    pub taken: usize,
}

/// What steps have in common: their length, `ln sigma_d` of the first, and the order of the method.
#[derive(Clone, Copy)]
pub(crate) struct StepFacts {
    pub h: f64,
    pub log_sigma: f64,
    pub order: u32,
}

impl EnergyMonitor {
    /// From a start, with or without the action. `energies` are those of the start's position and velocity, `T + V` where that is asked for.
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
                let look = EnergyLook { total, kinetic, terms, log_factor: 0.0, taken: 0 };
                monitor.known = Some((known, EnergyDrift::new(order, &look)));
                monitor.start = [total, kinetic + terms];
            }
        }
        monitor
    }

    /// Whether a look is due after so many steps.
    #[inline]
    pub fn is_due(&self, taken: usize) -> bool {
        let early = matches!(taken, 4 | 16 | 64 | 256);
        (early || taken.is_multiple_of(APART)) && self.tells(taken)
    }

    /// Whether a look after so many steps can tell something.
    pub fn tells(&self, taken: usize) -> bool {
        self.unresolved.is_none() && self.known.is_some() && taken > self.looked
    }

    /// What was seen so far.
    pub fn unresolved(&self) -> Option<UnresolvedStep> {
        self.unresolved
    }

    /// Looks at a state, whose energies are those at a time, `T + V` where that is asked for.
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
        // What may only fall is no drift where it falls.
        let [start, start_terms] = self.start;
        let (found, log_factor) = if bounded { (max_or_nan(total, start), 0.0) } else { (total, log_factor) };
        let look = EnergyLook { total: found, kinetic, terms, log_factor, taken };
        let rounding = |sigma: f64| f64::EPSILON * (kinetic + terms + start_terms * sigma);
        self.looked = taken;
        let Some(defect) = drift.defect(&look, rounding) else { return };
        // Only the times of the steps matter; and no more than a few thousand of them.
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
