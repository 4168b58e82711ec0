//! Runs of motions, and their records.

use crate::arrays::{matrix, value_error, vector};
use crate::motion::Motion;
use crate::signals::Signals;
use herglotz_runtime::{
    AfterReset, Crossing, INTERRUPTION, InitialVelocity, InputError, Outcome, OutputTimes, ResumeState, RunMonitor,
    RuntimeError, Status,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::ops::ControlFlow;

/// Stores the parts of the rows of a motion.
pub struct RowStore {
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
    signals: Signals,
    /// The exception that a signal handler has raised.
    raised: Option<PyErr>,
    /// The state at which a signal has interrupted the motion.
    halted: Option<ResumeState>,
}

impl RunMonitor for RowStore {
    fn row(&mut self, numbers: &[f64]) -> ControlFlow<()> {
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
        ControlFlow::Continue(())
    }

    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        self.crossings.push(crossing.clone());
        ControlFlow::Continue(())
    }

    fn poll(&mut self, _part: f64) -> ControlFlow<()> {
        self.signals.check()
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
    steps: usize,
    evaluations: u64,
    interrupted: Option<Py<PyAny>>,
    /// The state from which the motion can be resumed, bitwise.
    halted: Option<Vec<u8>>,
}

/// Runs a motion with the interpreter lock released.
#[pyfunction]
pub fn run(py: Python<'_>, motion: &Motion) -> PyResult<Record> {
    let (mut kept, request) = (RowStore::of(motion), &motion.motion);
    let outcome = py.detach(|| motion.system.run(request, &mut kept));
    record(py, kept, whole(motion, outcome)?)
}

/// Resumes a motion that was interrupted at a time, and keeps the remaining rows.
#[pyfunction]
pub fn resume(py: Python<'_>, motion: &Motion, halted: &[u8], at: f64) -> PyResult<Record> {
    let (mut kept, mut request) = (RowStore::of(motion), motion.motion.clone());
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
    fn of(motion: &Motion) -> Self {
        let n = motion.system.dimension();
        let own = crate::motion::columns(n, motion.conformal_factor).len();
        RowStore {
            extra: motion.motion.columns.len() - own,
            ..RowStore::new(n, motion.conformal_factor, motion.signals.clone())
        }
    }

    /// An empty record for n coordinates, without columns in addition to the state.
    pub fn new(n: usize, conformal_factor: bool, signals: Signals) -> Self {
        RowStore {
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
            signals,
            raised: None,
            halted: None,
        }
    }
}

/// Converts the result of a run for Python.
pub fn record(py: Python<'_>, mut kept: RowStore, outcome: Outcome) -> PyResult<Record> {
    kept.raised = kept.signals.take();
    let RowStore { n, extra, .. } = kept;
    let columns = if extra > 0 { Some(matrix(py, kept.columns, extra)?) } else { None };
    let crossed = |mut c: Crossing| {
        let after = after(&mut c);
        (c.event, c.t, c.q, c.v, c.p, c.z, after)
    };
    let crossings = kept.crossings.into_iter().map(crossed).collect();
    Ok(Record {
        t: vector(py, kept.t),
        q: matrix(py, kept.q, n)?,
        v: matrix(py, kept.v, n)?,
        p: matrix(py, kept.p, n)?,
        z: vector(py, kept.z),
        energy: vector(py, kept.energy),
        log_factor: kept.conformal_factor.then(|| vector(py, kept.log_factor)),
        columns,
        crossings,
        end: (outcome.t, outcome.q, outcome.p, outcome.z, outcome.v),
        status: outcome.status.to_string(),
        // A terminal event is a regular end.
        success: matches!(outcome.status, Status::Completed | Status::Stopped { .. }) && kept.raised.is_none(),
        unresolved: outcome.unresolved.map(|unresolved| unresolved.to_string()),
        error_estimate: outcome.error_estimate,
        steps: outcome.steps,
        evaluations: outcome.evaluations,
        halted: kept.halted.map(|halted| halted.to_bytes()),
        interrupted: kept.raised.map(|raised| raised.into_value(py).into_any()),
    })
}
