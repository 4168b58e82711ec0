//! What a user watches during a run: its progress, and functions that may stop it.

use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// The time between two reports of the progress.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(100);

/// The functions of Python: of the completed part, and of the record so far with the seconds between two calls.
pub type GivenWatch = Option<(Option<Py<PyAny>>, Option<(Py<PyAny>, f64)>)>;

/// Calls functions of Python during a run, at intervals, while the interpreter lock is released in between.
pub struct Watch {
    progress: Option<Py<PyAny>>,
    callback: Option<(Py<PyAny>, Duration)>,
    /// When they were called last, or when the run started.
    shown: Instant,
    called: Instant,
    /// Whether the callback is called at the next poll, with this present state as a row.
    due: bool,
    present: Vec<f64>,
    /// Whether the callback has stopped the run.
    pub stopped: bool,
    /// An exception of one of the functions.
    raised: Option<PyErr>,
}

impl Watch {
    /// The functions that are given, or none.
    pub fn of(given: GivenWatch) -> Self {
        let (progress, callback) = given.unwrap_or_default();
        // An interval that is too long for a duration never ends.
        let interval = |seconds: f64| Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX);
        let callback = callback.map(|(callback, seconds)| (callback, interval(seconds)));
        let now = Instant::now();
        Watch {
            progress,
            callback,
            shown: now,
            called: now,
            due: false,
            present: Vec::new(),
            stopped: false,
            raised: None,
        }
    }

    /// Whether the callback is called at the next poll, for which the present state is needed.
    pub fn is_due(&mut self) -> bool {
        self.due = self.callback.as_ref().is_some_and(|(_, interval)| self.called.elapsed() >= *interval);
        self.due
    }

    /// Stores the present state.
    pub fn present(&mut self, numbers: &[f64]) {
        self.present.clear();
        self.present.extend_from_slice(numbers);
    }

    /// Calls the functions that are due, with the completed part, and with the record so far, which is made from the present
    /// state.
    pub fn poll(
        &mut self,
        part: f64,
        record: impl FnOnce(Python<'_>, &[f64]) -> PyResult<Py<PyAny>>,
    ) -> ControlFlow<()> {
        if self.stopped || self.raised.is_some() {
            return ControlFlow::Break(());
        }
        let shows = self.progress.as_ref().filter(|_| self.shown.elapsed() >= PROGRESS_INTERVAL);
        let calls = self.callback.as_ref().filter(|_| self.due);
        if shows.is_none() && calls.is_none() {
            return ControlFlow::Continue(());
        }
        let called = Python::attach(|py| {
            if let Some(progress) = shows {
                progress.call1(py, (part,))?;
            }
            match calls {
                Some((callback, _)) => callback.call1(py, (record(py, &self.present)?,))?.is_truthy(py),
                None => Ok(false),
            }
        });
        // The time that the functions take does not count.
        if shows.is_some() {
            self.shown = Instant::now();
        }
        if calls.is_some() {
            self.called = Instant::now();
        }
        match called {
            Ok(false) => return ControlFlow::Continue(()),
            Ok(true) => self.stopped = true,
            Err(raised) => self.raised = Some(raised),
        }
        ControlFlow::Break(())
    }

    /// The exception that one of the functions has raised; it is cleared.
    pub fn take(&mut self) -> Option<PyErr> {
        self.raised.take()
    }
}
