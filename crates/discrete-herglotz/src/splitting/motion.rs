//! The common part of the splittings: compensated sums, a state of them, and a run in chunks of steps.

use crate::numbers::state_words::saved;
use crate::resolution::monitor::{ResolutionMonitor, sharper, turning};
use crate::{StepError, StepFailure};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, PhasePoint, numbers::max_or_nan};

/// A vector to which many small changes are added, with the round-off carried by compensated summation.
#[derive(Clone, Copy, Debug)]
pub(super) struct CompensatedVector<const N: usize> {
    pub(super) value: SVector<f64, N>,
    carry: SVector<f64, N>,
}

impl<const N: usize> CompensatedVector<N> {
    pub(super) fn new(value: SVector<f64, N>) -> Self {
        CompensatedVector { value, carry: SVector::zeros() }
    }

    /// Adds `change(i, value_i)` to each component, by Kahan's compensated summation if `COMPENSATED`.
    #[inline(always)]
    pub(super) fn add<const COMPENSATED: bool>(&mut self, change: impl Fn(usize, f64) -> f64) {
        for i in 0..N {
            let before = self.value[i];
            if COMPENSATED {
                let change = change(i, before) + self.carry[i];
                self.value[i] = before + change;
                self.carry[i] = change - (self.value[i] - before);
            } else {
                self.value[i] = before + change(i, before);
            }
        }
    }
}

/// The stored state of a run, with the value and the force of the next kick, evaluated at the last position.
#[derive(Clone, Copy, Debug)]
pub(super) struct CompensatedState<const N: usize> {
    pub(super) q: CompensatedVector<N>,
    pub(super) p: CompensatedVector<N>,
    pub(super) z: CompensatedVector<1>,
    pub(super) force: SVector<f64, N>,
    pub(super) value: f64,
    /// The change of the force over the last drift, times its length: a second difference of the momentum.
    change: SVector<f64, N>,
    /// `sigma_d` of the last step.
    pub(super) sigma: f64,
}

impl<const N: usize> CompensatedState<N> {
    pub(super) fn new(state: PhasePoint<N>, (value, force): (f64, SVector<f64, N>)) -> Self {
        let z = CompensatedVector::new(SVector::<f64, 1>::new(state.z));
        CompensatedState {
            q: CompensatedVector::new(state.q),
            p: CompensatedVector::new(state.p),
            z,
            force,
            value,
            change: SVector::zeros(),
            sigma: 1.0,
        }
    }

    pub(super) fn state(&self) -> PhasePoint<N> {
        PhasePoint { q: self.q.value, p: self.p.value, z: self.z.value[0] }
    }

    /// The flow of `-V` over a time s, with the stored force.
    #[inline(always)]
    pub(super) fn kick<const ACTION: bool, const COMPENSATED: bool>(&mut self, s: f64) {
        let (value, force) = (self.value, self.force);
        if ACTION {
            self.z.add::<COMPENSATED>(|_, _| s * value);
        }
        self.p.add::<COMPENSATED>(|i, _| s * force[i]);
    }

    /// Checks the drift over the time s that starts with the given momentum and force and ends with the stored ones, by
    /// the measures of a [`ResolutionMonitor`] for steps as long as the drift.
    #[inline(always)]
    pub(super) fn check_drift<const SUSPECTS: bool>(
        &mut self,
        momentum: &SVector<f64, N>,
        force: &SVector<f64, N>,
        s: f64,
        checks: &mut DriftChecks,
    ) {
        let now = (self.force - force) * s;
        let before = std::mem::replace(&mut self.change, now);
        if now.dot(&before) < 0.0 {
            let next = self.p.value + self.force * s;
            let momenta = [momentum.as_slice(), self.p.value.as_slice(), next.as_slice()];
            let changes = [before.as_slice(), now.as_slice()];
            if let Some(defect) = turning(changes, momenta, self.q.value.as_slice(), s, checks.floor) {
                checks.defect = max_or_nan(checks.defect, defect);
            }
        }
        if SUSPECTS
            && let Some(sharpness) = sharper([&now, &self.p.value, &self.q.value], s, checks.floor, checks.sharpest)
        {
            checks.sharpest = sharpness;
        }
    }
}

/// The results of the checks of drifts.
#[derive(Clone, Copy, Debug)]
pub(super) struct DriftChecks {
    /// The largest defect; 0 if none exceeds one.
    defect: f64,
    /// The largest sharpness so far, or the threshold if none exceeds it.
    sharpest: f64,
    /// Changes of position below this are round-off.
    floor: f64,
}

/// The result of some steps.
pub(super) struct Reached<const N: usize> {
    pub(super) motion: CompensatedState<N>,
    /// The completed state of the motion.
    pub(super) state: PhasePoint<N>,
    pub(super) checks: DriftChecks,
}

/// The number of steps between two checks that the motion is finite: the checks then take no measurable time, and the
/// repetition of a chunk in which one fails is short.
const MAX_UNCHECKED_STEPS: usize = 256;

/// The progress of a run.
#[derive(Clone, Debug)]
pub(super) struct SplittingRun<const N: usize> {
    pub(super) h: f64,
    pub(super) t0: f64,
    pub(super) taken: usize,
    /// The number of force evaluations per step.
    pub(super) forces: usize,
    pub(super) motion: CompensatedState<N>,
    /// The state after the steps taken: the motion, completed by the part of the last step that is combined with the
    /// next.
    pub(super) state: PhasePoint<N>,
    pub(super) monitor: ResolutionMonitor,
}

impl<const N: usize> SplittingRun<N> {
    pub(super) fn new(h: f64, t0: f64, forces: usize, state: PhasePoint<N>, kick: (f64, SVector<f64, N>)) -> Self {
        let monitor = ResolutionMonitor::new(state.q.as_slice(), &[0.0; N], h);
        SplittingRun { h, t0, taken: 0, forces, motion: CompensatedState::new(state, kick), state, monitor }
    }

    /// The time after this number of further steps.
    #[inline(always)]
    pub(super) fn time_after(&self, steps: usize) -> f64 {
        self.t0 + (self.taken + steps) as f64 * self.h
    }

    /// The number of force evaluations so far: those of the steps and the first one.
    pub(super) fn evaluations(&self) -> u64 {
        (self.taken * self.forces) as u64 + 1
    }

    /// The initial value of the check results for the next steps.
    #[inline(always)]
    pub(super) fn checks(&self) -> DriftChecks {
        DriftChecks { defect: 0.0, sharpest: self.monitor.steps.sharpest, floor: self.monitor.steps.floor }
    }

    /// Takes steps in chunks. A chunk that ends with a non-finite value, or that contains the first unresolved step or
    /// a new suspect interval, is repeated step by step in order to locate it.
    pub(super) fn advance(
        &mut self,
        steps: usize,
        after: &dyn Fn(&Self, usize) -> Reached<N>,
    ) -> Result<(), StepFailure> {
        let (mut taken, mut longest) = (0, MAX_UNCHECKED_STEPS);
        while taken < steps {
            let chunk = longest.min(steps - taken);
            let Reached { motion, state, checks: DriftChecks { defect, sharpest, .. } } = after(self, chunk);
            // A non-finite value in the motion makes this state or the next one non-finite.
            let finite = ChartVector::from(state).is_finite() && motion.sigma.is_finite();
            let defect = (defect > 0.0 && self.monitor.steps.first.is_none()).then_some(defect);
            let sharper = sharpest > self.monitor.steps.sharpest;
            if chunk > 1 && (!finite || defect.is_some() || sharper) {
                longest = 1;
                continue;
            }
            if !finite {
                return Err(StepFailure { taken, cause: StepError::NonFinite });
            }
            if let Some(defect) = defect {
                self.monitor.steps.note(self.taken, defect);
                longest = MAX_UNCHECKED_STEPS;
            } else if sharper {
                let t = self.time_after(0);
                self.monitor.suspect(sharpest, (self.taken, 1, t), [&self.state, &state]);
                longest = MAX_UNCHECKED_STEPS;
            }
            (self.motion, self.state) = (motion, state);
            self.taken += chunk;
            taken += chunk;
        }
        Ok(())
    }
}

saved!([const N: usize] CompensatedVector<N> { value, carry });
saved!([const N: usize] CompensatedState<N> { q, p, z, force, value, change, sigma });
saved!([const N: usize] SplittingRun<N> { taken, motion, state, monitor });
