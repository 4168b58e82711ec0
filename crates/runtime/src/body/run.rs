//! Runs of rigid bodies.

use super::integrator::{BodyIntegrator, BodyMethod, ForcedBody};
use super::observer::{EventValues, Halt, Observer, Rows};
use super::steps::of_integrator;
use super::{Body, BodyMotion, BodyOutcome};
use crate::body_resume_state::{BodyResumeState, Digest};
use crate::outcome::KeptRows;
use crate::{OutputTimes, RunMonitor, RuntimeError, StepControl};
use contact_geom::groups::{GroupError, Rotations};
use discrete_herglotz::groups::{GroupEvent, GroupMotion, GroupRows, GroupRun, GroupStatus};
use discrete_herglotz::{AnyIntegrator, InputError, Steps};
use std::fmt::Write;

/// A motion with its steps, after the checks of its input.
pub(super) struct Prepared {
    pub rows: Rows,
    pub state: GroupMotion<Rotations, 3>,
    pub by: AnyIntegrator,
    pub steps: usize,
    pub step_size: f64,
    pub integrator: BodyIntegrator,
    pub error_estimate: Option<f64>,
}

impl Body {
    /// Checks the input of a motion, and determines its steps.
    pub(super) fn prepare(&self, motion: &BodyMotion) -> Result<Prepared, RuntimeError> {
        let lagrangian = self.lagrangian()?;
        let state = motion.start(&lagrangian)?;
        if let Some(OutputTimes::Every(0)) = motion.rows {
            return Err(RuntimeError::argument("every", "is 0; it must be at least 1"));
        }
        let body = ForcedBody { lagrangian, force: self.torque.clone() };
        let (by, steps, error_estimate) = motion.steps(&body, &state)?;
        let step_size = (motion.end - motion.t) / steps as f64;
        let integrator = BodyMethod::integrator(&body, by, step_size, motion.interrupt.as_ref());
        let integrator = integrator.map_err(|error| of_integrator(&error))?;
        // A step that turns the body beyond the chart is refused before work starts.
        if let Err(error @ GroupError::BeyondChart { .. }) = state.clone().advance(&integrator, 1) {
            return Err(of_integrator(&error));
        }
        let rows = Rows { lagrangian, tip: self.tip() };
        Ok(Prepared { rows, state, by, steps, step_size, integrator, error_estimate })
    }

    /// Runs a motion. Each row has the [columns](Self::COLUMNS), and a crossing has them too, with the quaternion, the
    /// angular velocity and the momentum in the body as position, velocity and momentum. A failure of a step is reported
    /// in the status of the outcome.
    ///
    /// Where the interrupt of the motion ends the trial runs, the outcome is that of a motion that was stopped at its start.
    /// A motion that [`RunMonitor::poll`] ends is passed to [`RunMonitor::body_interrupted`], and checkpoints to
    /// [`RunMonitor::body_checkpoint`].
    ///
    /// # Errors
    /// [`RuntimeError::Argument`] and [`RuntimeError::NotFinite`] with the argument: a quaternion that is not a unit
    /// quaternion, an inertia that violates the triangle inequality, a first step that turns the body beyond the chart
    /// of the exponential map (with the largest step), an accuracy below round-off, an integrator that rigid bodies do
    /// not have; [`RuntimeError::Input`] for times of rows that are not in order.
    pub fn run(&self, motion: &BodyMotion, monitor: &mut dyn RunMonitor) -> Result<BodyOutcome, RuntimeError> {
        self.advance(motion, None, monitor)
    }

    /// Continues a motion from a saved state, with the same numbers to the last bit as a run that was not interrupted. If
    /// the steps were found for an accuracy, they are found again; to save this work, give their number.
    ///
    /// # Errors
    /// Those of [`run`](Self::run); [`InputError::AnotherRun`](crate::InputError::AnotherRun) for the state of another motion.
    pub fn resume(
        &self,
        motion: &BodyMotion,
        from: BodyResumeState,
        monitor: &mut dyn RunMonitor,
    ) -> Result<BodyOutcome, RuntimeError> {
        self.advance(motion, Some(from), monitor)
    }

    fn advance(
        &self,
        motion: &BodyMotion,
        from: Option<BodyResumeState>,
        monitor: &mut dyn RunMonitor,
    ) -> Result<BodyOutcome, RuntimeError> {
        let prepared = match self.prepare(motion) {
            // The trial runs were interrupted: the motion is at its start.
            Err(RuntimeError::Input(InputError::Interrupted)) => return self.at_start(motion),
            prepared => prepared?,
        };
        let Prepared { rows, mut state, by, steps, step_size, error_estimate, .. } = prepared;
        // The monitor ends the motion itself.
        let integrator = self.with_step(by, step_size)?;
        let of_run = fingerprint(self, motion, by, steps);
        let mut before = (0, 0);
        if let Some(from) = from {
            from.check(of_run)?;
            let damaged = |error: GroupError| RuntimeError::argument("from", format!("is refused: {error}"));
            state = GroupMotion::restore(&from.numbers).map_err(damaged)?;
            before = (from.taken, from.rows);
        }
        let values: Vec<EventValues> = motion.events.iter().map(|_| EventValues::new(step_size.signum())).collect();
        let events: Vec<GroupEvent<'_, Rotations, 3>> =
            motion.events.iter().zip(&values).map(|(event, values)| values.event(rows, event)).collect();
        let terminal: Vec<bool> = motion.events.iter().map(|event| event.terminal).collect();
        let times = |before: usize, passed: usize| match &motion.rows {
            None => GroupRows::Never,
            // The observer counts the steps from the start of the motion.
            Some(OutputTimes::Every(every)) => GroupRows::Every(if before == 0 { *every } else { 1 }),
            Some(OutputTimes::At(times)) => GroupRows::At(times.get(passed..).unwrap_or_default().to_vec()),
        };
        let mut observer = Observer {
            rows,
            monitor,
            t0: motion.t,
            h: step_size,
            count: steps,
            before: before.0,
            taken: before.0,
            every: if let Some(OutputTimes::Every(every)) = &motion.rows { Some(*every) } else { None },
            last_row: if let Some(OutputTimes::At(times)) = &motion.rows { times.last().copied() } else { None },
            passed: before.1,
            at_start: true,
            at_end: false,
            events: &values,
            terminal: &terminal,
            requested: None,
            halted: None,
        };
        let mut run = GroupRun { steps, rows: GroupRows::Never, events };
        let status = loop {
            (run.steps, run.rows) = (steps - observer.taken.min(steps), times(observer.before, observer.passed));
            let passed = observer.passed;
            let status = run.run(&mut state, &integrator, &mut observer).map_err(|error| match error {
                GroupError::Times { index, t, .. } => InputError::Times { index: passed + index, t }.into(),
                error => of_integrator(&error),
            })?;
            let Some(halt) = observer.halted.take() else { break status };
            let at = BodyResumeState::new(of_run, observer.taken, observer.passed, state.save());
            match halt {
                Halt::Interrupted => {
                    observer.monitor.body_interrupted(at);
                    break status;
                }
                Halt::Checkpoint if observer.monitor.body_checkpoint(observer.taken, at).is_break() => break status,
                Halt::Checkpoint => (observer.before, observer.at_start) = (observer.taken, true),
            }
        };
        let status = match status {
            GroupStatus::Failed { step, t, cause } => GroupStatus::Failed { step: observer.before + step, t, cause },
            status => status,
        };
        let t = if status == GroupStatus::Completed { motion.end } else { state.t() };
        let (row, taken) = (rows.row(t, &state.state()), observer.taken);
        Ok(BodyOutcome::new(status, (by, step_size, taken), &row, error_estimate))
    }

    /// The outcome of a motion that ends before its first step.
    fn at_start(&self, motion: &BodyMotion) -> Result<BodyOutcome, RuntimeError> {
        let lagrangian = self.lagrangian()?;
        let state = motion.start(&lagrangian)?;
        let by = match motion.step_control {
            StepControl::Accuracy { by, .. } => by.unwrap_or(BodyMethod::default_for(self.torque.is_some())),
            StepControl::Steps { by, .. } => by,
        };
        let row = Rows { lagrangian, tip: self.tip() }.row(motion.t, &state.state());
        Ok(BodyOutcome::new(GroupStatus::Stopped { t: motion.t }, (by, 0.0, 0), &row, None))
    }

    /// Runs a motion and keeps its rows.
    ///
    /// # Errors
    /// Those of [`run`](Self::run).
    pub fn record(&self, motion: &BodyMotion) -> Result<(BodyOutcome, Vec<Vec<f64>>), RuntimeError> {
        let mut kept = KeptRows::default();
        let outcome = self.run(motion, &mut kept)?;
        Ok((outcome, kept.0))
    }
}

/// A digest of the body, the motion and its steps; of events it has their number, directions and ends.
fn fingerprint(body: &Body, motion: &BodyMotion, by: AnyIntegrator, count: usize) -> u64 {
    let mut digest = Digest::new();
    // The steps may be given, or have been found for an accuracy.
    let steps = StepControl::Steps { by, steps: Steps::Count(count) };
    let BodyMotion { t, attitude, omega, z, end, step_control: _, rows, events, interrupt: _ } = motion;
    // An expression has no text that is the same in all processes.
    let events: Vec<_> = events.iter().map(|event| (event.direction, event.terminal)).collect();
    // Writing to a digest does not fail.
    let _ = write!(digest, "{body:?} {t} {attitude:?} {omega:?} {z} {end} {steps:?} {rows:?} {events:?}");
    digest.0
}
