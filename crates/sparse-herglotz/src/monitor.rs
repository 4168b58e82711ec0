//! Detection of steps that do not resolve the motion, from the known evolution of the energy.

use crate::drag::Drag;
use crate::energies::{Energies, EnergyKind};
use crate::system::{SparseSystem, State};
use contact_geom::numbers::max_or_nan;
use discrete_herglotz::{
    UnresolvedStep,
    checks::{EnergyDrift, EnergySample},
};

/// The number of steps between two energy checks in long runs. A check costs about five of the least expensive steps,
/// which is half a per cent of 1024 steps.
const STEPS_BETWEEN_CHECKS: usize = 1024;

/// The maximum number of times at which a system is tested for dependence on time, which bounds the cost of the test.
/// Forcing with up to half as many periods in a run is sampled at least twice a period.
const MAX_TEST_TIMES: usize = 4096;

/// The error of `ln sigma_d` in a step above which the step does not resolve the drag; the same value as for Gauss
/// collocation on small systems.
const MAX_LOG_SIGMA_ERROR: f64 = 0.1;

/// Checks the energy of a run after 4, 16, 64 and 256 steps, every 1024 steps, and on request.
#[derive(Clone, Debug)]
pub(crate) struct EnergyMonitor {
    /// `None` if the evolution of no energy is known, or if the system was found to depend on time.
    monitored: Option<(EnergyKind, EnergyDrift)>,
    /// The energy at the start, and the size of its terms.
    start: [f64; 2],
    t0: f64,
    /// The number of steps at the last check.
    checked_at: usize,
    unresolved: Option<UnresolvedStep>,
}

/// How far a run has advanced.
#[derive(Clone, Copy)]
pub(crate) struct RunProgress {
    pub t: f64,
    /// The logarithm of the conformal factor since the start.
    pub log_factor: f64,
    pub taken: usize,
}

/// Data of the steps of a run: the step size, `ln sigma_d` of the first step, and the order of the method.
#[derive(Clone, Copy)]
pub(crate) struct StepInfo {
    pub h: f64,
    pub log_sigma: f64,
    pub order: u32,
}

impl EnergyMonitor {
    /// The monitor of a run from `start`, with or without the action. `energies` returns the energies at the start, of
    /// the kind that is its argument.
    pub fn new(
        system: &SparseSystem,
        start: State,
        StepInfo { h, log_sigma, order }: StepInfo,
        energies: impl FnOnce(EnergyKind) -> Energies,
    ) -> Self {
        let general = !system.general_terms.is_empty();
        let (kind, defect) = match &system.drag {
            _ if general => (Some(EnergyKind::Lagrangian), 0.0),
            // The work of friction is not computed.
            _ if system.friction.is_some() => (None, 0.0),
            Drag::Constant(gamma) => {
                let conserved = start.z.is_some() || *gamma == 0.0;
                let bounded = (gamma * h < 0.0).then_some(EnergyKind::Mechanical);
                (
                    if conserved { Some(EnergyKind::Lagrangian) } else { bounded },
                    (log_sigma - gamma * h).abs() / MAX_LOG_SIGMA_ERROR,
                )
            }
            Drag::Timed(_) => (Some(EnergyKind::Mechanical), 0.0),
        };
        let mut monitor = EnergyMonitor {
            monitored: None,
            start: [0.0; 2],
            t0: start.t,
            checked_at: 0,
            unresolved: (defect > 1.0).then_some(UnresolvedStep { step: 0, defect }),
        };
        if let Some(kind) = kind {
            let Energies { kinetic, total, terms } = energies(kind);
            if total.is_finite() && kinetic.is_finite() {
                let sample = EnergySample { total, kinetic, terms, log_factor: 0.0, taken: 0 };
                monitor.monitored = Some((kind, EnergyDrift::new(order, &sample)));
                monitor.start = [total, kinetic + terms];
            }
        }
        monitor
    }

    /// Whether a check is due after `taken` steps.
    #[inline]
    pub fn is_due(&self, taken: usize) -> bool {
        // Early checks report a step that is far too long before much is computed with it.
        let early = matches!(taken, 4 | 16 | 64 | 256);
        (early || taken.is_multiple_of(STEPS_BETWEEN_CHECKS)) && self.can_check(taken)
    }

    /// Whether a check after `taken` steps can give new information.
    pub fn can_check(&self, taken: usize) -> bool {
        self.unresolved.is_none() && self.monitored.is_some() && taken > self.checked_at
    }

    /// The first unresolved step found so far.
    pub fn unresolved(&self) -> Option<UnresolvedStep> {
        self.unresolved
    }

    /// Checks the energy of a state. `energies` returns the energies of this state at a given time, of the kind that is
    /// its second argument.
    pub fn check(
        &mut self,
        system: &SparseSystem,
        progress: RunProgress,
        mut energies: impl FnMut(f64, EnergyKind) -> Energies,
    ) {
        let Some((kind, drift)) = &mut self.monitored else { return };
        let (kind, RunProgress { t, log_factor, taken }) = (*kind, progress);
        let bounded = kind == EnergyKind::Mechanical;
        let Energies { kinetic, total, terms } = energies(t, kind);
        // A decrease of the bounded energy is not a drift.
        let [start, start_terms] = self.start;
        let (found, log_factor) = if bounded { (max_or_nan(total, start), 0.0) } else { (total, log_factor) };
        let sample = EnergySample { total: found, kinetic, terms, log_factor, taken };
        let rounding = |sigma: f64| f64::EPSILON * (kinetic + terms + start_terms * sigma);
        self.checked_at = taken;
        let Some(defect) = drift.defect(&sample, rounding) else { return };
        // The test for dependence on time uses the times of the steps, or `MAX_TEST_TIMES` equidistant times if there
        // are more steps.
        let span = t - self.t0;
        let times = taken.min(MAX_TEST_TIMES);
        let steady = (0..times).all(|i| {
            let s = self.t0 + span * (i as f64 / times as f64);
            let dissipates = !bounded || system.rate(s) * span <= 0.0;
            dissipates && energies(s, kind).total.to_bits() == total.to_bits()
        });
        if steady {
            self.unresolved = Some(UnresolvedStep { step: taken - 1, defect });
        } else {
            self.monitored = None;
        }
    }
}
