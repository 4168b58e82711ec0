//! Runs of motions, and their records.

use crate::arrays::{matrix, value_error, vector};
use crate::motion::Motion;
use crate::signals::Signals;
use crate::watch::{GivenWatch, Watch};
use herglotz_runtime::{
    AfterReset, Crossing, INTERRUPTION, InitialVelocity, InputError, Outcome, OutputTimes, ResumeState, RunMonitor,
    RuntimeError, Status,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::ops::ControlFlow;

/// The parts of the rows of a motion, and its crossings.
#[derive(Clone)]
struct Parts {
    n: usize,
    /// The number of columns in addition to the state.
    extra: usize,
    conformal_factor: bool,
    t: Vec<f64>,
    q: Vec<f64>,
    v: Vec<f64>,
    p: Vec<f64>,
    z: Vec<f64>,
    energy: Vec<f64>,
    log_factor: Vec<f64>,
    columns: Vec<f64>,
    crossings: Vec<Crossing>,
}

impl Parts {
    /// Adds a row.
    fn push(&mut self, numbers: &[f64]) {
        let n = self.n;
        let mut rest = numbers;
        let mut take = |count: usize, to: &mut Vec<f64>| {
            let (first, others) = rest.split_at(count.min(rest.len()));
            to.extend_from_slice(first);
            rest = others;
        };
        take(1, &mut self.t);
        take(n, &mut self.q);
        take(n, &mut self.v);
        take(n, &mut self.p);
        take(1, &mut self.z);
        take(1, &mut self.energy);
        if self.conformal_factor {
            take(1, &mut self.log_factor);
        }
        take(usize::MAX, &mut self.columns);
    }

    /// The record of a motion that is in progress, whose last row is its end so far.
    fn into_record(self, py: Python<'_>) -> PyResult<Record> {
        let Parts { n, extra, .. } = self;
        let last = |x: &[f64]| x[x.len().saturating_sub(n)..].to_vec();
        let t = self.t.last().copied().unwrap_or(f64::NAN);
        let end = (t, last(&self.q), last(&self.p), self.z.last().copied(), Some(last(&self.v)));
        let columns = if extra > 0 { Some(matrix(py, self.columns, extra)?) } else { None };
        let crossed = |mut c: Crossing| {
            let after = after(&mut c);
            (c.event, c.t, c.q, c.v, c.p, c.z, after)
        };
        Ok(Record {
            t: vector(py, self.t),
            q: matrix(py, self.q, n)?,
            v: matrix(py, self.v, n)?,
            p: matrix(py, self.p, n)?,
            z: vector(py, self.z),
            energy: vector(py, self.energy),
            log_factor: self.conformal_factor.then(|| vector(py, self.log_factor)),
            columns,
            crossings: self.crossings.into_iter().map(crossed).collect(),
            end,
            status: "in progress".to_owned(),
            success: false,
            unresolved: None,
            error_estimate: None,
            steps: None,
            evaluations: None,
            halted: None,
            interrupted: None,
        })
    }
}

/// Stores the rows of a motion.
pub struct RowStore {
    parts: Parts,
    signals: Signals,
    watch: Watch,
    /// The state at which a signal or a callback has interrupted the motion.
    halted: Option<ResumeState>,
}

impl RunMonitor for RowStore {
    fn row(&mut self, numbers: &[f64]) -> ControlFlow<()> {
        self.parts.push(numbers);
        ControlFlow::Continue(())
    }

    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        self.parts.crossings.push(crossing.clone());
        ControlFlow::Continue(())
    }

    fn wants_present(&mut self) -> bool {
        self.watch.is_due()
    }

    fn present(&mut self, numbers: &[f64]) {
        self.watch.present(numbers);
    }

    fn poll(&mut self, part: f64) -> ControlFlow<()> {
        self.signals.check()?;
        let parts = &self.parts;
        self.watch.poll(part, |py, present| {
            let mut so_far = parts.clone();
            if present.first() != so_far.t.last() {
                so_far.push(present);
            }
            Ok(Py::new(py, so_far.into_record(py)?)?.into_any())
        })
    }

    fn interrupted(&mut self, at: ResumeState) {
        self.halted = Some(at);
    }
}

/// The end of a motion: t, q, p, z, and v where it is known.
type End = (f64, Vec<f64>, Vec<f64>, Option<f64>, Option<Vec<f64>>);

/// A crossing: the index of the event, t, q, v, p and z, and q, v, p and z after a reset.
type Crossed = (usize, f64, Vec<f64>, Vec<f64>, Vec<f64>, f64, After);

/// The state q, v, p and z after a reset.
pub type After = Option<(Vec<f64>, Vec<f64>, Vec<f64>, f64)>;

/// The state after the reset of a crossing.
pub fn after(crossing: &mut Crossing) -> After {
    crossing.after.take().map(|AfterReset { q, v, p, z }| (q, v, p, z))
}

/// The record of a motion by rows.
#[pyclass(frozen, get_all, module = "herglotz._core")]
pub struct Record {
    t: Py<PyArray1<f64>>,
    q: Py<PyArray2<f64>>,
    v: Py<PyArray2<f64>>,
    p: Py<PyArray2<f64>>,
    z: Py<PyArray1<f64>>,
    energy: Py<PyArray1<f64>>,
    log_factor: Option<Py<PyArray1<f64>>>,
    /// The requested columns.
    columns: Option<Py<PyArray2<f64>>>,
    crossings: Vec<Crossed>,
    /// The final state, whether it is a row or not.
    end: End,
    status: String,
    success: bool,
    unresolved: Option<String>,
    error_estimate: Option<f64>,
    /// The numbers of steps and of evaluations; `None` while the motion runs.
    steps: Option<usize>,
    evaluations: Option<u64>,
    interrupted: Option<Py<PyAny>>,
    /// The state from which the motion can be resumed, bitwise.
    halted: Option<Vec<u8>>,
}

/// Runs a motion with the interpreter lock released.
#[pyfunction]
#[pyo3(signature = (motion, watch = None))]
pub fn run(py: Python<'_>, motion: &Motion, watch: GivenWatch) -> PyResult<Record> {
    let (mut kept, request) = (RowStore::of(motion, watch), &motion.motion);
    let outcome = py.detach(|| motion.system.run(request, &mut kept));
    record(py, kept, whole(motion, outcome)?)
}

/// Resumes a motion that was interrupted at a time, and keeps the remaining rows.
#[pyfunction]
#[pyo3(signature = (motion, halted, at, watch = None))]
pub fn resume(py: Python<'_>, motion: &Motion, halted: &[u8], at: f64, watch: GivenWatch) -> PyResult<Record> {
    let (mut kept, mut request) = (RowStore::of(motion, watch), motion.motion.clone());
    let from = ResumeState::from_bytes(halted).map_err(value_error)?;
    if let Some(OutputTimes::At(times)) = &mut request.rows {
        let onward = request.end >= request.start.t;
        times.retain(|t| if onward { *t > at } else { *t < at });
    }
    let outcome = py.detach(|| motion.system.resume(&request, from, &mut kept));
    record(py, kept, whole(motion, outcome)?)
}

/// The outcome of a motion, also where its plan was interrupted.
fn whole(motion: &Motion, outcome: Result<Outcome, RuntimeError>) -> PyResult<Outcome> {
    match outcome {
        Err(RuntimeError::Input(InputError::Interrupted)) => Ok(outcome_of_start(motion)),
        outcome => outcome.map_err(value_error),
    }
}

/// The outcome of a motion whose plan was interrupted: its start, without rows.
fn outcome_of_start(motion: &Motion) -> Outcome {
    let start = &motion.motion.start;
    let p = match &start.velocity {
        InitialVelocity::Momentum(p) | InitialVelocity::MomentumNear { p, .. } => Some(p.clone()),
        InitialVelocity::Velocity(_) => motion.system.geometry(start).ok().map(|geometry| geometry.momentum),
    };
    Outcome {
        status: Status::Stopped { step: 0, t: start.t, by: INTERRUPTION },
        unresolved: None,
        steps: 0,
        rests_from: None,
        t: start.t,
        q: start.q.clone(),
        p: p.unwrap_or_else(|| vec![f64::NAN; start.q.len()]),
        // Where several velocities correspond to the momentum, the initial one.
        v: match &start.velocity {
            InitialVelocity::Velocity(v) | InitialVelocity::MomentumNear { v, .. } => Some(v.clone()),
            InitialVelocity::Momentum(_) => None,
        },
        z: Some(start.z),
        log_factor: None,
        error_estimate: None,
        evaluations: 0,
    }
}

impl RowStore {
    fn of(motion: &Motion, watch: GivenWatch) -> Self {
        let n = motion.system.dimension();
        let own = crate::motion::columns(n, motion.conformal_factor).len();
        let mut kept = RowStore::new(n, motion.conformal_factor, motion.signals.clone(), watch);
        kept.parts.extra = motion.motion.columns.len() - own;
        kept
    }

    /// An empty record for n coordinates, without columns in addition to the state.
    pub fn new(n: usize, conformal_factor: bool, signals: Signals, watch: GivenWatch) -> Self {
        let parts = Parts {
            n,
            extra: 0,
            conformal_factor,
            t: Vec::new(),
            q: Vec::new(),
            v: Vec::new(),
            p: Vec::new(),
            z: Vec::new(),
            energy: Vec::new(),
            log_factor: Vec::new(),
            columns: Vec::new(),
            crossings: Vec::new(),
        };
        RowStore { parts, signals, watch: Watch::of(watch), halted: None }
    }
}

/// Converts the result of a run for Python.
pub fn record(py: Python<'_>, mut kept: RowStore, outcome: Outcome) -> PyResult<Record> {
    let raised = kept.signals.take().or_else(|| kept.watch.take());
    // A terminal event is a regular end.
    let reached = matches!(outcome.status, Status::Completed | Status::Stopped { .. });
    let status = match kept.watch.stopped {
        true => format!("stopped by `callback` at t = {}", outcome.t),
        false => outcome.status.to_string(),
    };
    Ok(Record {
        end: (outcome.t, outcome.q, outcome.p, outcome.z, outcome.v),
        status,
        success: reached && raised.is_none() && !kept.watch.stopped,
        unresolved: outcome.unresolved.map(|unresolved| unresolved.to_string()),
        error_estimate: outcome.error_estimate,
        steps: Some(outcome.steps),
        evaluations: Some(outcome.evaluations),
        halted: kept.halted.map(|halted| halted.to_bytes()),
        interrupted: raised.map(|raised| raised.into_value(py).into_any()),
        ..kept.parts.into_record(py)?
    })
}
