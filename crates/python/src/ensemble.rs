//! Ensembles: many motions of one formula.

use crate::arrays::{matrix, named, number, numbers, table, value_error, vector, whole};
use crate::events::GivenEvent;
use crate::motion::{self, GivenStepControl};
use crate::run::{After, after};
use crate::signals::with_signals;
use crate::system::System;
use herglotz_runtime::{
    Column, Crossing, Ensemble, EnsembleMonitor, INTERRUPTION, InitialVelocity, Interrupt, MemberEnd, OutputTimes,
    Start, Status, StepControl, Tally, Varied, in_words,
};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Stores the final states of the members, or their rows.
struct RowStore {
    n: usize,
    /// The number of rows of each member, where rows are requested.
    rows: Option<usize>,
    extra: usize,
    parts: [Vec<f64>; 5],
    t: Vec<f64>,
    steps: Vec<i64>,
    success: Vec<bool>,
    troubles: Vec<(usize, String)>,
    crossings: Vec<(usize, Crossing)>,
    /// The number of members that have ended.
    done: Arc<AtomicUsize>,
    /// Whether a signal handler has raised an exception.
    ended: Arc<AtomicBool>,
}

impl RowStore {
    fn states(&mut self, row: &[f64]) {
        let mut rest = row;
        for (part, count) in self.parts.iter_mut().zip([self.n, self.n, self.n, 1, self.extra]) {
            let (first, others) = rest.split_at(count.min(rest.len()));
            part.extend_from_slice(first);
            part.resize(part.len() + count - first.len(), f64::NAN);
            rest = others;
        }
    }
}

impl RowStore {
    /// Adds the members that were not started because of an interruption.
    fn fill(&mut self, count: usize) {
        while self.success.len() < count {
            let index = self.success.len();
            self.success.push(false);
            self.troubles.push((index, "interrupted before its start".to_owned()));
            self.t.push(f64::NAN);
            self.steps.push(0);
            for _ in 0..self.rows.unwrap_or(1) {
                self.states(&[]);
            }
        }
    }
}

impl EnsembleMonitor for RowStore {
    fn member(&mut self, member: MemberEnd) -> ControlFlow<()> {
        let MemberEnd { index, ending, rows, crossings } = member;
        self.crossings.extend(crossings.into_iter().map(|crossing| (index, crossing)));
        let trouble = match &ending {
            Err(cause) => Some(in_words(cause)),
            Ok(end) => match (&end.status, &end.unresolved) {
                (Status::Stopped { by: INTERRUPTION, t, .. }, _) => Some(format!("interrupted at t = {t}")),
                // A terminal event is a regular end.
                (Status::Completed | Status::Stopped { .. }, unresolved) => {
                    unresolved.map(|unresolved| unresolved.to_string())
                }
                (status, _) => Some(status.to_string()),
            },
        };
        let reached = |status| match status {
            Status::Stopped { by, .. } => by != INTERRUPTION,
            status => status == Status::Completed,
        };
        self.success.push(ending.as_ref().is_ok_and(|end| reached(end.status)));
        self.troubles.extend(trouble.map(|trouble| (index, trouble)));
        self.t.push(ending.as_ref().map_or(f64::NAN, |end| end.t));
        self.steps.push(ending.as_ref().map_or(0, |end| end.steps as i64));
        self.done.store(self.t.len(), Ordering::Relaxed);
        match self.rows {
            None => {
                let row = ending.map(|end| end.columns).unwrap_or_default();
                self.states(&row);
            }
            Some(count) => {
                for k in 0..count {
                    self.states(rows.get(k).map_or(&[], Vec::as_slice));
                }
            }
        }
        // An interruption is polled elsewhere: all members that have ended are stored.
        ControlFlow::Continue(())
    }

    fn interrupt(&self) -> Option<Interrupt> {
        let ended = self.ended.clone();
        Some(Interrupt::when(move || ended.load(Ordering::Relaxed)))
    }

    fn poll(&mut self) -> ControlFlow<()> {
        if self.ended.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// The index of the member, the index of the event, t, q, v, p and z, and q, v, p and z after a reset.
type Found = (usize, usize, f64, Vec<f64>, Vec<f64>, Vec<f64>, f64, After);

/// The final states of many motions, or their rows one after the other.
#[pyclass(frozen, get_all, module = "herglotz._core")]
pub struct EnsembleRecord {
    t: Py<PyArray1<f64>>,
    q: Py<PyArray2<f64>>,
    v: Py<PyArray2<f64>>,
    p: Py<PyArray2<f64>>,
    z: Py<PyArray1<f64>>,
    columns: Option<Py<PyArray2<f64>>>,
    steps: Py<PyArray1<i64>>,
    success: Py<PyArray1<bool>>,
    /// Errors and warnings, by the index of the member.
    troubles: Vec<(usize, String)>,
    /// The sign changes of events.
    crossings: Vec<Found>,
    /// The times of the rows.
    times: Option<Py<PyArray1<f64>>>,
    batch_kernel: usize,
    own_plans: usize,
    /// The exception that a signal handler has raised.
    interrupted: Option<Py<PyAny>>,
}

/// The positions, the velocities or the momenta, whether these are momenta, and the actions.
pub type GivenStarts<'py> = (Bound<'py, PyAny>, Bound<'py, PyAny>, bool, Bound<'py, PyAny>);

/// The members of an ensemble, from the arguments of `ensemble`.
pub struct Members {
    pub count: usize,
    n: usize,
    q: Vec<f64>,
    velocity: Vec<f64>,
    is_momentum: bool,
    z: Vec<f64>,
    names: Vec<String>,
    /// The values of each of these parameters, one for each member.
    varied: Vec<Vec<f64>>,
    t0: f64,
    end: f64,
    step_control: StepControl,
    threads: Option<usize>,
}

impl Members {
    pub fn new(
        system: &System,
        (q, velocity, is_momentum, z): GivenStarts<'_>,
        times: &[f64],
        step_control: &GivenStepControl<'_>,
        names: Vec<String>,
        values: &[Bound<'_, PyAny>],
        threads: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let n = system.formula.given_dimension();
        let (count, q) = table("q0", &q, n)?;
        let argument = if is_momentum { "p0" } else { "v0" };
        let (velocity_count, velocity) = table(argument, &velocity, n)?;
        if velocity_count != count {
            return Err(value_error(format!("`{argument}` has {velocity_count} rows, where `q0` has {count}")));
        }
        let members = |name: &str, of: &Bound<'_, PyAny>| -> PyResult<Vec<f64>> {
            let found = numbers(name, of)?;
            match found.len() {
                1 if of.len().is_err() => Ok(vec![number(name, of)?; count]),
                length if length == count => Ok(found),
                length => Err(value_error(format!("`{name}` has {length} numbers, but there are {count} members"))),
            }
        };
        let z = members("z0", &z)?;
        let mut varied = Vec::with_capacity(names.len());
        for (name, value) in names.iter().zip(values) {
            varied.push(members(&format!("parameters[{name:?}]"), value)?);
        }
        let step_control = motion::step_control(step_control)?;
        let threads = threads.map(|threads| whole("threads", &threads, 1)).transpose()?;
        let (Some(&t0), Some(&end)) = (times.first(), times.last()) else { return Err(value_error("`t` is empty")) };
        Ok(Members { count, n, q, velocity, is_momentum, z, names, varied, t0, end, step_control, threads })
    }

    /// Calls a function with the ensemble, without rows and events.
    pub fn ensemble<R>(&self, then: impl FnOnce(Ensemble<'_>) -> R) -> R {
        let Members { count, n, t0, end, step_control, threads, .. } = *self;
        let start = |i: usize| {
            let part = |x: &[f64]| x.get(i * n..(i + 1) * n).unwrap_or_default().to_vec();
            let velocity = if self.is_momentum {
                InitialVelocity::Momentum(part(&self.velocity))
            } else {
                InitialVelocity::Velocity(part(&self.velocity))
            };
            Start { t: t0, q: part(&self.q), velocity, z: self.z.get(i).copied().unwrap_or(f64::NAN) }
        };
        let values = |i: usize| self.varied.iter().map(|all| all.get(i).copied().unwrap_or(f64::NAN)).collect();
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        let varied = (!names.is_empty()).then_some(Varied { names: &names, values: &values });
        then(Ensemble {
            count,
            start: &start,
            t0,
            varied,
            end,
            step_control,
            rows: None,
            columns: &[],
            events: &[],
            threads,
        })
    }
}

/// Runs an ensemble with the interpreter lock released.
#[pyfunction]
#[pyo3(signature = (system, start, t, step_control, names, values, events, observed, threads, progress = None))]
#[expect(clippy::too_many_arguments, reason = "they are those of `ensemble`, which names them")]
pub fn run_ensemble(
    py: Python<'_>,
    system: &System,
    start: GivenStarts<'_>,
    t: Bound<'_, PyAny>,
    step_control: GivenStepControl<'_>,
    names: Vec<String>,
    values: Vec<Bound<'_, PyAny>>,
    events: Vec<GivenEvent<'_>>,
    observed: Vec<String>,
    threads: Option<Bound<'_, PyAny>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<EnsembleRecord> {
    let times = motion::times(&t)?;
    let members = Members::new(system, start, &times, &step_control, names, &values, threads)?;
    let count = members.count;
    let rows = (times.len() > 2).then(|| times.clone());
    let (with_resets, events) = crate::events::events(events, system)?;
    let n = with_resets.dimension();
    let mut columns: Vec<Column> = (0..n).map(Column::Position).collect();
    columns.extend((0..n).map(Column::Velocity));
    columns.extend((0..n).map(Column::Momentum));
    columns.push(Column::Action);
    for text in &observed {
        columns.push(named("the column", text, Column::parse(text, with_resets.formula()))?);
    }
    let done = Arc::new(AtomicUsize::new(0));
    let mut kept = RowStore {
        n,
        rows: rows.as_ref().map(Vec::len),
        extra: observed.len(),
        parts: Default::default(),
        t: Vec::with_capacity(count),
        steps: Vec::with_capacity(count),
        success: Vec::with_capacity(count),
        troubles: Vec::new(),
        crossings: Vec::new(),
        done: done.clone(),
        ended: Arc::new(AtomicBool::new(false)),
    };
    let report = |py: Python<'_>| match &progress {
        Some(progress) => progress.call1(py, (done.load(Ordering::Relaxed) as f64 / count as f64,)).map(drop),
        None => Ok(()),
    };
    let run = |ended: &Arc<AtomicBool>| {
        kept.ended = ended.clone();
        members.ensemble(|ensemble| {
            let rows = rows.clone().map(OutputTimes::At);
            with_resets.ensemble(&Ensemble { rows, columns: &columns, events: &events, ..ensemble }, &mut kept)
        })
    };
    let (tally, raised) = with_signals(py, report, run)?;
    let tally = match tally {
        // The ensemble was interrupted before it began.
        Err(_) if raised.is_some() => Tally::default(),
        tally => tally.map_err(value_error)?,
    };
    if raised.is_some() {
        kept.fill(count);
    }
    let [q, v, p, z, columns] = kept.parts;
    let found = |(member, mut c): (usize, Crossing)| {
        let after = after(&mut c);
        (member, c.event, c.t, c.q, c.v, c.p, c.z, after)
    };
    Ok(EnsembleRecord {
        t: vector(py, kept.t),
        q: matrix(py, q, n)?,
        v: matrix(py, v, n)?,
        p: matrix(py, p, n)?,
        z: vector(py, z),
        columns: if kept.extra > 0 { Some(matrix(py, columns, kept.extra)?) } else { None },
        steps: PyArray1::from_vec(py, kept.steps).unbind(),
        success: PyArray1::from_vec(py, kept.success).unbind(),
        troubles: kept.troubles,
        crossings: kept.crossings.into_iter().map(found).collect(),
        times: rows.map(|rows| vector(py, rows)),
        batch_kernel: tally.batch_kernel,
        own_plans: tally.own_plans,
        interrupted: raised.map(|raised| raised.into_value(py).into_any()),
    })
}
