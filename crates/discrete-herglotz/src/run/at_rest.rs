//! The part of a run after its motion has come to rest: observers see it, although no step is taken.

use crate::integration::motion::{Motion, NearbyVelocity};
use crate::integration::{RunSupport, StepDetails};
use crate::run::checks::rest::origin;
use crate::run::integrate::Integration;
use crate::run::observers::observer::Observer;
use crate::run::observers::step_view::StepView;
use crate::{DenseStep, State, StepError, StepFailure, Stepper, Vector};
use contact_geom::nalgebra::DMatrix;

/// The number of steps in an interval of the rest, where an observer follows it: between two of them the run can be
/// interrupted.
const STEPS_PER_INTERVAL: f64 = 256.0;

/// An interval of time in which the motion is at rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RestInterval {
    /// `L_z`, the rate of the conformal factor.
    pub rate: f64,
    /// The length of a step, negative if the run goes backward in time.
    pub h: f64,
}

impl RestInterval {
    /// The times of both ends of the steps of length h between two times; the last step may be shorter.
    pub fn steps(self, from: f64, to: f64) -> impl Iterator<Item = [f64; 2]> {
        intervals(from, to, self.h)
    }
}

/// The intervals of length h between two times, each with both ends; the last one may be shorter. One interval if h is not
/// a number.
fn intervals(from: f64, to: f64, h: f64) -> impl Iterator<Item = [f64; 2]> {
    let end = move |k: u64| {
        let t = from + k as f64 * h;
        // Written so that a NaN is the end.
        let is_before = if to < from { t > to } else { t < to };
        if is_before { t } else { to }
    };
    (0..).map(move |k| [end(k), end(k + 1)]).take_while(move |[start, _]| *start != to)
}

/// A motion at rest, in the place of the motion and of the stepper of a run.
struct AtRest<'r> {
    motion: &'r dyn Motion,
    /// The stepper of the run, at the time of rest.
    stepper: &'r dyn Stepper,
    t: f64,
    state: State,
    rate: f64,
}

impl Stepper for AtRest<'_> {
    fn advance(&mut self, _steps: usize) -> Result<(), StepFailure> {
        Ok(())
    }

    fn state(&self) -> State {
        self.state.clone()
    }

    fn time(&self) -> f64 {
        self.t
    }

    fn sigma(&self) -> f64 {
        1.0
    }

    fn evaluations(&self) -> u64 {
        self.stepper.evaluations()
    }

    fn last_step(&self) -> Option<&dyn StepDetails> {
        Some(self)
    }

    fn run_support(&self) -> Option<&dyn RunSupport> {
        self.stepper.run_support()
    }
}

impl StepDetails for AtRest<'_> {
    fn last_velocity(&self) -> Option<Vector> {
        self.stepper.last_velocity()
    }
}

impl Motion for AtRest<'_> {
    fn velocity(&self, t: f64, state: &State, near: NearbyVelocity<'_>) -> Result<Vector, StepError> {
        self.motion.velocity(t, state, near)
    }

    fn inverse_mass(&self) -> Option<&DMatrix<f64>> {
        self.motion.inverse_mass()
    }

    fn velocity_and_energy(&self, t: f64, state: &State, near: NearbyVelocity<'_>) -> Result<(Vector, f64), StepError> {
        self.motion.velocity_and_energy(t, state, near)
    }

    fn rates(&self, _t: f64, state: &State, _near: NearbyVelocity<'_>) -> Result<State, StepError> {
        let zero = || Vector::zeros(state.q.len());
        Ok(State { q: zero(), p: zero(), z: 0.0 })
    }

    fn fingerprint(&self) -> u64 {
        self.motion.fingerprint()
    }

    fn state_within_step(
        &self,
        (from, state): &(f64, State),
        t: f64,
        _near: NearbyVelocity<'_>,
        _curve: Option<&DenseStep>,
    ) -> Result<(State, f64), StepError> {
        Ok((state.clone(), (self.rate * (t - from)).exp()))
    }
}

impl Integration<'_, '_, '_> {
    /// Calls the observers along the rest of the span, if the motion has come to rest in it.
    pub(super) fn rest(&mut self) {
        let Some(until) = self.rested_until.filter(|_| self.status.is_none()) else { return };
        let (plan, from, t_end) = (self.plan, self.stepper.time(), self.info.t_end);
        let (problem, state) = (&plan.steps.problem, self.stepper.state());
        let rate = problem.system.gradient(from, &origin(problem, state.z)).z;
        let h = self.info.h.unwrap_or_else(|| plan.steps.h * problem.system.dt_dtau(&state.q));
        let (taken, findings) = (self.taken, self.checks.findings);
        let stepper = &*self.stepper;
        let follows = self.observers.follows_rest(&plan.view(stepper, None, findings, (taken, false)), t_end);
        let length = if follows { STEPS_PER_INTERVAL * h } else { t_end - from };
        let mut stop = None;
        // A resumed run continues after the intervals that have been seen.
        let is_seen = |t: f64| if t_end < from { t >= until } else { t <= until };
        for [before, t] in intervals(from, t_end, length).skip_while(|[_, t]| is_seen(*t)) {
            let findings = self.checks.findings;
            let log_factor = findings.log_factor + rate * (t - before);
            let rest = AtRest { motion: &plan.steps, stepper, t, state: state.clone(), rate };
            let view = StepView {
                t,
                sigma: (rate * (t - before)).exp(),
                log_factor: plan.steps.needs.conformal_factor.then_some(log_factor),
                before: Some((before, state.clone())),
                motion: &rest,
                stepper: &rest,
                at_rest: Some(RestInterval { rate, h }),
                ..plan.view(stepper, None, findings, (taken, t == t_end))
            };
            stop = self.observers.step(&view).break_value();
            let end = stop.as_ref().and_then(|stop| stop.at.as_ref()).map_or(t, |(t, _)| *t);
            self.checks.findings.log_factor = log_factor - rate * (t - end);
            if let Some(stop) = &mut stop {
                stop.at.get_or_insert_with(|| (t, state.clone()));
                break;
            }
        }
        self.stop(stop);
        if self.status.is_none() {
            self.end = Some((t_end, state));
        }
    }
}
