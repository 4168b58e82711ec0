//! What every splitting moves: sums that may carry their rounding, a state of them, and a run in chunks.

use crate::numbers::state_words::saved;
use crate::resolution::monitor::{ResolutionMonitor, sharper, turning};
use crate::{StepError, StepFailure, integration::SuspectInterval};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, PhasePoint, numbers::max_or_nan};

/// A vector that many small changes are added to, with what rounding has taken from the compensated ones so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct CompensatedVector<const N: usize> {
    pub(super) value: SVector<f64, N>,
    carry: SVector<f64, N>,
}

impl<const N: usize> CompensatedVector<N> {
    pub(super) fn new(value: SVector<f64, N>) -> Self {
        CompensatedVector { value, carry: SVector::zeros() }
    }

    /// Adds `change(i, value_i)` to each component; compensated by Kahan's sum.
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

/// Where a run goes on from, with the value and the derivative of the next kick: those at the last position.
#[derive(Clone, Copy, Debug)]
pub(super) struct CompensatedState<const N: usize> {
    pub(super) q: CompensatedVector<N>,
    pub(super) p: CompensatedVector<N>,
    pub(super) z: CompensatedVector<1>,
    pub(super) force: SVector<f64, N>,
    pub(super) value: f64,
    /// What the last drift changed of the force, times its length: the second difference of the momentum.
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

    /// The flow of `-V` over a time s, with the force that the motion holds.
    #[inline(always)]
    pub(super) fn kick<const ACTION: bool, const COMPENSATED: bool>(&mut self, s: f64) {
        let (value, force) = (self.value, self.force);
        if ACTION {
            self.z.add::<COMPENSATED>(|_, _| s * value);
        }
        self.p.add::<COMPENSATED>(|i, _| s * force[i]);
    }

    /// Looks at a drift over the time s, between the momentum and the force before it and those that the motion holds, as a
    /// [`ResolutionMonitor`] does at steps as long as the drift.
    #[inline(always)]
    pub(super) fn look<const DOUBTS: bool>(
        &mut self,
        momentum: &SVector<f64, N>,
        force: &SVector<f64, N>,
        s: f64,
        seen: &mut DriftLooks,
    ) {
        let now = (self.force - force) * s;
        let before = std::mem::replace(&mut self.change, now);
        if now.dot(&before) < 0.0 {
            let momenta = [momentum, &self.p.value, &(self.p.value + self.force * s)];
            if let Some(defect) = turning([&before, &now], momenta, &self.q.value, s, seen.floor) {
                seen.defect = max_or_nan(seen.defect, defect);
            }
        }
        if DOUBTS && let Some(sharpness) = sharper([&now, &self.p.value, &self.q.value], s, seen.floor, seen.sharpest) {
            seen.sharpest = sharpness;
        }
    }
}

/// What looks at drifts have seen.
#[derive(Clone, Copy, Debug)]
pub(super) struct DriftLooks {
    /// The largest misfit; 0 where none is above one.
    defect: f64,
    /// The sharpness of the sharpest turn, or what none is beyond.
    sharpest: f64,
    /// What is moved at most by rounding.
    floor: f64,
}

/// Where some steps lead.
pub(super) struct Reached<const N: usize> {
    pub(super) motion: CompensatedState<N>,
    /// The state that the motion stands for.
    pub(super) state: PhasePoint<N>,
    pub(super) seen: DriftLooks,
}

/// The steps between two looks whether the motion is finite.
const CHUNK: usize = 256;

/// How far a run has come.
#[derive(Clone, Debug)]
pub(super) struct SplittingRun<const N: usize> {
    pub(super) h: f64,
    pub(super) t0: f64,
    pub(super) taken: usize,
    /// The forces of a step.
    pub(super) forces: usize,
    pub(super) motion: CompensatedState<N>,
    /// The state after the steps taken: that of the motion, completed where the next step has a part of the last.
    pub(super) state: PhasePoint<N>,
    pub(super) watch: ResolutionMonitor<N>,
}

impl<const N: usize> SplittingRun<N> {
    pub(super) fn new(h: f64, t0: f64, forces: usize, state: PhasePoint<N>, kick: (f64, SVector<f64, N>)) -> Self {
        let watch = ResolutionMonitor::new(&state.q, &SVector::zeros(), h);
        SplittingRun { h, t0, taken: 0, forces, motion: CompensatedState::new(state, kick), state, watch }
    }

    /// The time after so many steps more.
    #[inline(always)]
    pub(super) fn time_after(&self, steps: usize) -> f64 {
        self.t0 + (self.taken + steps) as f64 * self.h
    }

    /// The forces evaluated so far: those of the steps, and the first.
    pub(super) fn evaluations(&self) -> u64 {
        (self.taken * self.forces) as u64 + 1
    }

    /// Nothing, so far.
    #[inline(always)]
    pub(super) fn seen(&self) -> DriftLooks {
        DriftLooks { defect: 0.0, sharpest: self.watch.sharpest, floor: self.watch.floor }
    }

    /// Takes steps in chunks; one that ends with what is not finite step by step up to the last that is, and one with the first
    /// misfit, or with a doubt, step by step up to that.
    pub(super) fn advance(
        &mut self,
        steps: usize,
        after: impl Fn(&Self, usize) -> Reached<N>,
    ) -> Result<(), StepFailure> {
        let (mut taken, mut longest) = (0, CHUNK);
        while taken < steps {
            let chunk = longest.min(steps - taken);
            let Reached { motion, state, seen: DriftLooks { defect, sharpest, .. } } = after(self, chunk);
            // What is not finite in the motion is not finite in its state, or in the next.
            let finite = ChartVector::from(state).is_finite() && motion.sigma.is_finite();
            let defect = (defect > 0.0 && self.watch.first.is_none()).then_some(defect);
            let sharper = sharpest > self.watch.sharpest;
            if chunk > 1 && (!finite || defect.is_some() || sharper) {
                longest = 1;
                continue;
            }
            if !finite {
                return Err(StepFailure { taken, cause: StepError::NonFinite });
            }
            if let Some(defect) = defect {
                self.watch.note(self.taken, defect);
                longest = CHUNK;
            } else if sharper {
                let (t, from) = (self.time_after(0), self.state);
                self.watch.doubt(sharpest, SuspectInterval { step: self.taken, steps: 1, t, from, to: state });
                longest = CHUNK;
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
saved!([const N: usize] SplittingRun<N> { taken, motion, state, watch });
