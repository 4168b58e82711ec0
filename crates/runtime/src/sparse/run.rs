//! Runs of systems of many coordinates.

use super::stepper::{OwnedState, Stepper};
use super::system::SiteSystem;
use crate::clock::Clock;
use crate::outcome::KeptRows;
use crate::{InitialVelocity, Outcome, OutputTimes, RunMonitor, RuntimeError, Start};
use discrete_herglotz::{AnyIntegrator, InputError, Status, StepError, StepFailure, Steps};
use std::ops::ControlFlow;
use std::time::Duration;

/// The time between two polls: short for a user, long for a step.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// The maximal number of steps between two polls, as for motions of few coordinates.
const MAX_STEPS_BETWEEN_POLLS: usize = 256;

/// A motion of a system of many coordinates.
#[derive(Clone, Debug)]
pub struct SiteMotion {
    /// The initial state; the components of one site or body follow each other.
    pub start: Start,
    /// The final time, before or after the initial time.
    pub end: f64,
    /// The integrator: a splitting, `midpoint`, `gauss_1` or `gauss_2`.
    pub by: AnyIntegrator,
    /// The length of a step, reduced slightly so that a whole number of steps fills the span, or the number of steps.
    pub steps: Steps,
    /// The times at which rows are recorded. A row at a time within a step is computed by a shorter step of the same
    /// integrator.
    pub rows: OutputTimes,
    /// Whether rows and the outcome have the logarithm of the conformal factor.
    pub conformal_factor: bool,
    /// The numbers of a row that are passed on, by their places in the whole row; all of them where this is `None`. The energy
    /// is computed only where it is among them.
    pub columns: Option<Vec<usize>>,
}

impl SiteMotion {
    /// From a start to a time with given steps, with a row at each step.
    pub fn new(start: Start, end: f64, by: AnyIntegrator, steps: Steps) -> Self {
        SiteMotion { start, end, by, steps, rows: OutputTimes::Every(1), conformal_factor: false, columns: None }
    }

    /// The length of a step, with its sign, and the number of steps.
    ///
    /// # Errors
    /// [`RuntimeError::Argument`] where the end or the length is not one.
    pub fn step(&self) -> Result<(f64, usize), RuntimeError> {
        let span = self.end - self.start.t;
        if !(span != 0.0 && span.is_finite()) {
            let why = format!(
                "ends at {}, and the motion starts at {}; give a finite end that is later or earlier than the start",
                self.end, self.start.t
            );
            return Err(RuntimeError::argument("t", why));
        }
        let count = match self.steps {
            Steps::Count(0) => return Err(InputError::NoSteps.into()),
            Steps::Count(count) => return Ok((span / count as f64, count)),
            Steps::Size(h) => {
                if !(h > 0.0 && h.is_finite()) {
                    return Err(RuntimeError::argument(
                        "step",
                        format!("is {h}; it must be a positive number, since the end gives the direction"),
                    ));
                }
                // As for small systems: a quotient that differs from an integer by rounding only is taken for that
                // integer.
                (span.abs() / h * (1.0 - 4.0 * f64::EPSILON)).ceil().max(1.0)
            }
        };
        // Integers up to here are exact in floating point.
        const LARGEST: f64 = (1u64 << 53) as f64;
        if count > LARGEST {
            return Err(RuntimeError::argument(
                "step",
                format!("gives {count:.1e} steps, which exceeds the largest possible number; take a longer step"),
            ));
        }
        Ok((span / count, count as usize))
    }
}

/// The state of a run in progress.
struct SparseRun<'a, 'w> {
    of: &'a SiteSystem,
    motion: &'a SiteMotion,
    stepper: Stepper<'a>,
    h: f64,
    count: usize,
    taken: usize,
    /// The number of steps between two polls.
    steps_between_polls: usize,
    log_factor: f64,
    last: OwnedState,
    /// The whole row.
    all: Vec<f64>,
    /// The numbers of it that are passed on.
    numbers: Vec<f64>,
    monitor: &'w mut dyn RunMonitor,
}

/// Why a motion ends early.
enum Ended {
    /// Ended from outside.
    Stopped,
    /// A step failed.
    Failed(StepError),
    /// The shorter step to a row within a step could not be set up.
    Refused(RuntimeError),
}

impl From<StepError> for Ended {
    fn from(cause: StepError) -> Self {
        Ended::Failed(cause)
    }
}

impl From<RuntimeError> for Ended {
    fn from(error: RuntimeError) -> Self {
        Ended::Refused(error)
    }
}

impl SiteSystem {
    /// Runs a motion. Each row has `t`, the positions, the velocities, the momenta, `z` and the energy, followed by the
    /// logarithm of the conformal factor where it is requested. A failure during the run is reported in the status of
    /// the outcome, whose state is then that of the last row.
    ///
    /// # Errors
    /// [`RuntimeError::Argument`], [`RuntimeError::Length`] and [`RuntimeError::NotFinite`] with the argument;
    /// [`RuntimeError::Assembly`].
    pub fn run(&self, motion: &SiteMotion, monitor: &mut dyn RunMonitor) -> Result<Outcome, RuntimeError> {
        run(self, motion, monitor)
    }

    /// Runs a motion and keeps its rows.
    ///
    /// # Errors
    /// Those of [`run`](Self::run).
    pub fn record(&self, motion: &SiteMotion) -> Result<(Outcome, Vec<Vec<f64>>), RuntimeError> {
        let mut kept = KeptRows::default();
        let outcome = self.run(motion, &mut kept)?;
        Ok((outcome, kept.0))
    }
}

fn run(of: &SiteSystem, motion: &SiteMotion, monitor: &mut dyn RunMonitor) -> Result<Outcome, RuntimeError> {
    let (h, count) = motion.step()?;
    check_rows(motion)?;
    check_columns(of, motion)?;
    let start = initial_state(of, &motion.start)?;
    let stepper = Stepper::new(of, motion.by, h, &start)?;
    let all = Vec::with_capacity(width_of(of, motion));
    let mut run = SparseRun {
        of,
        motion,
        stepper,
        h,
        count,
        taken: 0,
        steps_between_polls: 1,
        log_factor: 0.0,
        last: start,
        all,
        numbers: Vec::new(),
        monitor,
    };
    let status = match run.run() {
        Ok(()) => Status::Completed,
        Err(Ended::Stopped) => Status::Stopped { step: run.taken, t: run.time(run.taken), by: "the monitor" },
        Err(Ended::Failed(cause)) => Status::Failed { step: run.taken, t: run.time(run.taken), cause },
        Err(Ended::Refused(error)) => return Err(error),
    };
    Ok(run.outcome(status))
}

/// Checks the times of the rows.
fn check_rows(motion: &SiteMotion) -> Result<(), RuntimeError> {
    let times = match &motion.rows {
        OutputTimes::Every(0) => return Err(RuntimeError::argument("every", "is 0; it must be at least 1")),
        OutputTimes::Every(_) => return Ok(()),
        OutputTimes::At(times) => times,
    };
    let onward = motion.end > motion.start.t;
    let before = |a: f64, b: f64| if onward { a <= b } else { a >= b };
    let mut last = motion.start.t;
    for (index, time) in times.iter().enumerate() {
        if !(before(last, *time) && before(*time, motion.end)) {
            return Err(InputError::Times { index, t: *time }.into());
        }
        last = *time;
    }
    Ok(())
}

/// The number of numbers of a whole row.
fn width_of(of: &SiteSystem, motion: &SiteMotion) -> usize {
    3 + 3 * of.dimension() + usize::from(motion.conformal_factor)
}

/// The place of the energy in a whole row.
fn place_of_energy(of: &SiteSystem) -> usize {
    2 + 3 * of.dimension()
}

/// Checks the places of the columns.
fn check_columns(of: &SiteSystem, motion: &SiteMotion) -> Result<(), RuntimeError> {
    let width = width_of(of, motion);
    match motion.columns.iter().flatten().find(|place| **place >= width) {
        Some(place) => {
            let why = format!("has the place {place}; a row has {width} numbers, with places from 0");
            Err(RuntimeError::argument("columns", why))
        }
        None => Ok(()),
    }
}

/// The start, validated.
fn initial_state(of: &SiteSystem, start: &Start) -> Result<OwnedState, RuntimeError> {
    for (what, value) in [("t", start.t), ("z", start.z)] {
        if !value.is_finite() {
            return Err(RuntimeError::NotFinite { what: what.into(), value });
        }
    }
    let vector = |what: &'static str, x: &[f64]| {
        if x.len() != of.dimension() {
            return Err(RuntimeError::Length { what, found: x.len(), expected: of.dimension() });
        }
        match x.iter().enumerate().find(|(_, x)| !x.is_finite()) {
            Some((i, value)) => Err(RuntimeError::NotFinite { what: format!("{what}[{i}]"), value: *value }),
            None => Ok(of.inward(x)),
        }
    };
    let v = match &start.velocity {
        InitialVelocity::Velocity(v) => vector("v", v)?,
        InitialVelocity::Momentum(p) | InitialVelocity::MomentumNear { p, .. } => {
            vector("p", p)?.iter().zip(&of.masses).map(|(p, m)| p / m).collect()
        }
    };
    Ok(OwnedState { t: start.t, q: vector("q", &start.q)?, v, z: start.z })
}

impl SparseRun<'_, '_> {
    /// The time after a number of steps.
    fn time(&self, taken: usize) -> f64 {
        if taken == self.count { self.motion.end } else { self.motion.start.t + taken as f64 * self.h }
    }

    fn run(&mut self) -> Result<(), Ended> {
        match &self.motion.rows {
            OutputTimes::Every(every) => {
                self.row()?;
                while self.taken < self.count {
                    self.advance((self.taken / every + 1).saturating_mul(*every).min(self.count))?;
                    self.row()?;
                }
            }
            OutputTimes::At(times) => {
                for time in times {
                    self.row_at(*time)?;
                }
                self.advance(self.count)?;
                self.update_state()?;
            }
        }
        Ok(())
    }

    /// Takes steps until this number has been taken.
    fn advance(&mut self, to: usize) -> Result<(), Ended> {
        while self.taken < to {
            let begin = Clock::new();
            // The conformal factor is that of a single step, so it is read after each.
            let steps_between_polls =
                if self.motion.conformal_factor { 1 } else { self.steps_between_polls.min(to - self.taken) };
            if let Err(StepFailure { taken, cause }) = self.stepper.advance(steps_between_polls) {
                self.taken += taken;
                return Err(cause.into());
            }
            self.taken += steps_between_polls;
            if self.motion.conformal_factor {
                self.log_factor += self.stepper.sigma().ln();
            }
            let slow = begin.elapsed() > POLL_INTERVAL;
            self.steps_between_polls = if slow {
                (self.steps_between_polls / 2).max(1)
            } else {
                (self.steps_between_polls * 2).min(MAX_STEPS_BETWEEN_POLLS)
            };
            if self.monitor.wants_present() {
                self.update_state()?;
                self.set_numbers(self.log_factor)?;
                self.monitor.present(&self.numbers);
            }
            if self.monitor.poll(self.taken as f64 / self.count as f64).is_break() {
                return Err(Ended::Stopped);
            }
        }
        Ok(())
    }

    /// Stores the current state.
    fn update_state(&mut self) -> Result<(), Ended> {
        self.last = OwnedState { t: self.time(self.taken), ..self.stepper.state()? };
        Ok(())
    }

    /// A row of the current state.
    fn row(&mut self) -> Result<(), Ended> {
        self.update_state()?;
        self.write(self.log_factor)
    }

    /// A row at a time: at the end of a step, or within one.
    fn row_at(&mut self, time: f64) -> Result<(), Ended> {
        let steps = (time - self.motion.start.t) / self.h;
        let (nearest, rounding) =
            (steps.round(), 4.0 * f64::EPSILON * (1.0 + self.motion.start.t.abs() / self.h.abs() + steps));
        let near = (steps - nearest).abs() <= rounding;
        let whole = if near { nearest } else { steps.floor() };
        self.advance((whole.max(0.0) as usize).min(self.count))?;
        self.update_state()?;
        let mut log_factor = self.log_factor;
        if near || time == self.last.t {
            self.last.t = time;
        } else {
            let mut part = Stepper::new(self.of, self.motion.by, time - self.last.t, &self.last)?;
            part.advance(1).map_err(|failure| failure.cause)?;
            if self.motion.conformal_factor {
                log_factor += part.sigma().ln();
            }
            self.last = OwnedState { t: time, ..part.state()? };
        }
        self.write(log_factor)
    }

    /// Sets the numbers of a row of the stored state.
    fn set_numbers(&mut self, log_factor: f64) -> Result<(), Ended> {
        let OwnedState { t, q, v, z } = &self.last;
        let columns = self.motion.columns.as_deref();
        let wants_energy = columns.is_none_or(|columns| columns.contains(&place_of_energy(self.of)));
        let energy = if wants_energy { self.of.energy(&self.last)? } else { f64::NAN };
        let all = &mut self.all;
        all.clear();
        all.push(*t);
        self.of.outward(q, all);
        self.of.outward(v, all);
        self.of.outward(&self.of.momenta(v), all);
        all.extend([*z, energy]);
        all.extend(self.motion.conformal_factor.then_some(log_factor));
        match columns {
            Some(columns) => {
                self.numbers.clear();
                self.numbers.extend(columns.iter().map(|place| self.all[*place]));
            }
            None => std::mem::swap(&mut self.numbers, &mut self.all),
        }
        Ok(())
    }

    /// Passes on a row of the stored state.
    fn write(&mut self, log_factor: f64) -> Result<(), Ended> {
        self.set_numbers(log_factor)?;
        match self.monitor.row(&self.numbers) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Ended::Stopped),
        }
    }

    fn outcome(mut self, status: Status) -> Outcome {
        if matches!(status, Status::Stopped { .. }) {
            // The state from which the motion could continue; that of the last row if it is not finite.
            if let Ok(state) = self.stepper.state() {
                self.last = OwnedState { t: self.time(self.taken), ..state };
            }
        }
        let of = self.of;
        let outward = |x: &[f64]| {
            let mut all = Vec::with_capacity(x.len());
            of.outward(x, &mut all);
            all
        };
        let OwnedState { t, q, v, z } = &self.last;
        Outcome {
            status,
            unresolved: self.stepper.unresolved(),
            steps: self.taken,
            t: *t,
            q: outward(q),
            p: outward(&of.momenta(v)),
            v: Some(outward(v)),
            z: Some(*z),
            log_factor: self.motion.conformal_factor.then_some(self.log_factor),
            error_estimate: None,
            rests_from: None,
            evaluations: self.stepper.evaluations(self.taken),
        }
    }
}
