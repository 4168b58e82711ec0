//! The main loop of a run.

use crate::integration::motion::Motion;
use crate::run::checks::rest::is_at_rest;
use crate::run::checks::{Checks, TakenSteps, single_step_stop};
use crate::run::end_within_step::end_within_step;
use crate::run::findings::Findings;
use crate::run::observers::observer::Observer;
use crate::run::observers::output_request::{OutputRequest, RunInfo};
use crate::run::observers::step_view::{StepView, Stop};
use crate::run::{Outcome, Plan, ResumeState};
use crate::status::first;
use crate::{InputError, State, Status, StepError, Stepper};

/// The observers of a run, in the order in which they were added.
pub(crate) type Observers<'o> = Vec<Box<dyn Observer + 'o>>;

/// Takes the steps of a plan, from its start or from a resumed state. Steps after which no check and no observer is due
/// are taken together; the checks, and then the observers, see the end of the last of them.
pub(crate) fn integrate(
    plan: &Plan<'_>,
    observers: &mut Observers<'_>,
    from: Option<&ResumeState>,
) -> Result<Outcome, InputError> {
    let mut run = Integration::new(plan, observers, from)?;
    run.start();
    while run.status.is_none() && !run.over {
        let first = run.taken;
        let seen = run.seen.take();
        let before = run.needs_start().then(|| seen.unwrap_or_else(|| (run.stepper.time(), run.stepper.state())));
        if let Err(cause) = run.advance() {
            run.fail(cause);
            break;
        }
        run.over = plan.steps.is_over(run.taken, run.stepper.time());
        let (stepper, taken, over) = (&mut *run.stepper, run.taken, run.over);
        let mut step = TakenSteps { stepper, before, first, taken, over };
        let is_full_check = step.are_fully_checked();
        if let Some(false_claim) = run.checks.check(&mut step) {
            run.status = Some(false_claim);
            break;
        }
        let before = step.into_single();
        run.look_for_rest(is_full_check || run.taken >= run.next_observed(first));
        run.observe(first, before);
    }
    run.rest();
    Ok(run.outcome())
}

impl Plan<'_> {
    /// Performs the run without observers.
    ///
    /// # Errors
    /// Those of [`stepper`](Self::stepper). A failure during the run is the outcome's status.
    pub fn run(&self) -> Result<Outcome, InputError> {
        integrate(self, &mut Vec::new(), None)
    }
}

/// The state of a run in progress.
pub(super) struct Integration<'r, 'p, 'o> {
    pub plan: &'r Plan<'p>,
    pub observers: &'r mut Observers<'o>,
    pub info: RunInfo,
    pub stepper: Box<dyn Stepper + 'p>,
    pub checks: Checks<'r, 'p>,
    pub taken: usize,
    /// The end of a trial run that took the same steps, if nothing between is observed or checked.
    known_end: Option<Box<dyn Stepper + 'p>>,
    /// The time and the state after the last step, if observers have seen it.
    seen: Option<(f64, State)>,
    /// Whether the last step has been taken.
    over: bool,
    /// If the motion has come to rest, the time until which observers have seen it.
    pub rested_until: Option<f64>,
    /// The status, if the run ended before its last step.
    pub status: Option<Status>,
    /// The time and the state at the end, if the run ended within a step or at rest.
    pub end: Option<(f64, State)>,
}

impl<'r, 'p, 'o> Integration<'r, 'p, 'o> {
    fn new(
        plan: &'r Plan<'p>,
        observers: &'r mut Observers<'o>,
        from: Option<&ResumeState>,
    ) -> Result<Self, InputError> {
        let steps = &plan.steps;
        let mut stepper = plan.take_stepper()?;
        if steps.needs.saved && stepper.save().is_none() {
            return Err(InputError::Unsaved);
        }
        let in_transformed_time = steps.info.in_transformed_time;
        // If the trial runs found an event that ends the run, or a time of rest, the number of steps up to it.
        let expected = plan.ends_after.into_iter().chain(plan.rests_after).min();
        let expected = expected.map_or(steps.count, |ended| steps.count.min(ended.saturating_add(1)));
        let info = RunInfo {
            dimension: steps.problem.system.dimension(),
            t0: steps.problem.t0,
            t_end: steps.t_end,
            h: (!in_transformed_time).then_some(steps.h),
            count: (!in_transformed_time || steps.error.is_some()).then_some(expected),
        };
        observers.prepare(&info)?;
        let (mut checks, mut taken) = (Checks::of(steps, plan.constant_rate, plan.ends_after), 0);
        let mut rested_until = None;
        if let Some(from) = from {
            if from.fingerprint != steps.fingerprint() || !stepper.restore(&from.words) {
                return Err(InputError::AnotherRun);
            }
            let ResumeState { log_factor, unresolved, energy, .. } = *from;
            (taken, rested_until) = (from.taken, from.rested_until);
            checks.resume(Findings { log_factor, unresolved, energy });
        }
        // A run may be resumed at its end.
        let over = steps.is_over(taken, stepper.time());
        let known_end = if from.is_none() { plan.take_end() } else { None };
        let mut run = Integration {
            plan,
            observers,
            info,
            stepper,
            checks,
            taken,
            known_end,
            seen: None,
            over,
            rested_until,
            status: None,
            end: None,
        };
        if from.is_some() || plan.rests_after == Some(0) {
            run.look_for_rest(true);
        }
        Ok(run)
    }

    /// Calls the observers at the start.
    fn start(&mut self) {
        let last = self.over && self.rested_until.is_none();
        let mut start = self.plan.view(&*self.stepper, None, self.checks.findings, (self.taken, last));
        start.t = self.rested_until.unwrap_or(start.t);
        let stop = self.observers.start(&start).break_value();
        self.stop(stop);
    }

    /// The number of steps after which an observer or a check is due next.
    fn next(&self) -> usize {
        let observed = single_step_stop(self.taken, self.next_observed(self.taken));
        let rests = self.plan.rests_after.filter(|steps| *steps > self.taken).unwrap_or(usize::MAX);
        observed.min(self.checks.next(self.taken)).min(rests).min(self.plan.steps.most())
    }

    fn next_observed(&self, taken: usize) -> usize {
        self.observers.next(taken).max(taken + 1)
    }

    /// Whether the state before the next step is needed.
    fn needs_start(&self) -> bool {
        self.checks.needs_start(self.taken) || self.next_observed(self.taken) == self.taken + 1
    }

    /// Takes the steps up to the next one that is observed or checked, or all of them if they are known.
    fn advance(&mut self) -> Result<(), StepError> {
        let chunk = self.next() - self.taken;
        let (done, cause) = if let Some(end) = self.known_end.take() {
            self.stepper = end;
            (self.plan.steps.count, Ok(()))
        } else {
            match self.stepper.advance_until(chunk, self.plan.steps.t_end) {
                Ok(done) => (done, Ok(())),
                Err(failure) => (failure.taken, Err(failure.cause)),
            }
        };
        self.taken += done;
        self.checks.multiply(self.taken, done, self.stepper.sigma());
        cause
    }

    /// Ends the run at a failed step: an observer may end it within that step.
    fn fail(&mut self, cause: StepError) {
        let (findings, taken) = (self.checks.findings, self.taken);
        match end_within_step(self.plan, self.observers, &*self.stepper, self.info, (findings, taken)) {
            Some((stop, log_factor)) => {
                self.taken += 1;
                self.checks.findings.log_factor = log_factor.unwrap_or(findings.log_factor);
                self.stop(Some(stop));
            }
            None => self.status = Some(Status::Failed { step: taken, t: self.stepper.time(), cause }),
        }
    }

    /// Ends the steps if the motion is at rest: after the steps of the trial runs if these ended at rest, and at steps that
    /// are checked or observed, since functions of smaller numbers than those of rest are round-off.
    fn look_for_rest(&mut self, is_due: bool) {
        let (steps, t) = (&self.plan.steps, self.stepper.time());
        let rests = |state: &State| is_at_rest(&steps.problem, steps.needs, (t, steps.t_end), state);
        let is_expected = self.plan.rests_after == Some(self.taken);
        if !self.over && (is_expected || is_due && rests(&self.stepper.state())) {
            self.rested_until = self.rested_until.or(Some(t));
        }
        self.over |= self.rested_until.is_some();
    }

    /// Calls the observers at the end of the last step, if they are due.
    fn observe(&mut self, first: usize, before: Option<(f64, State)>) {
        if self.taken >= self.next_observed(first) || self.over {
            let (findings, last) = (self.checks.findings, self.over && self.rested_until.is_none());
            let end = self.plan.view(&*self.stepper, before, findings, (self.taken, last));
            let stop = self.observers.step(&end).break_value();
            if let Some(Stop { at: Some((t, _)), .. }) = stop
                && let Some(step) = end.last_step()
                && let Ok(StepView { log_factor: Some(there), .. }) = end.within(&step, t)
            {
                self.checks.findings.log_factor = there;
            }
            self.seen = Some((end.t, end.state));
            self.stop(stop);
        }
    }

    /// Ends the run if an observer stopped it.
    pub fn stop(&mut self, stop: Option<Stop>) {
        let Some(Stop { by, cause, at }) = stop else { return };
        let step = self.taken;
        let t = at.as_ref().map_or(self.stepper.time(), |(t, _)| *t);
        self.end = at;
        self.status = Some(match cause {
            Some(cause) => Status::Failed { step, t, cause },
            None => Status::Stopped { step, t, by },
        });
    }

    fn outcome(self) -> Outcome {
        let Integration { plan, stepper, checks, taken, rested_until, status, end, .. } = self;
        let steps = &plan.steps;
        let (t, state, velocity) = (stepper.time(), stepper.state(), stepper.last_velocity());
        let near = velocity.as_ref();
        let error_estimate =
            plan.estimated.then(|| steps.error.unwrap_or_else(|| steps.distance_from_halves(taken, t, (&state, near))));
        let (t, state) = end.unwrap_or((t, state));
        let OutputRequest { action, conformal_factor, .. } = steps.needs;
        let Findings { log_factor, unresolved, .. } = checks.findings;
        Outcome {
            status: status.unwrap_or(Status::Completed),
            unresolved: first(plan.unreached_accuracy(), first(unresolved, checks.unresolved_by(&*stepper))),
            steps: taken,
            rests_from: rested_until.map(|_| stepper.time()),
            t,
            v: steps.velocity(t, &state, near).ok(),
            q: state.q,
            p: state.p,
            z: action.then_some(state.z),
            log_factor: conformal_factor.then_some(log_factor),
            error_estimate,
            evaluations: stepper.evaluations(),
            z_or_start: state.z,
        }
    }
}
