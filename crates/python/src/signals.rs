//! Whether the user has asked to end a run.

use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

/// The time between two looks: short for a hand, long for a run.
const BETWEEN: Duration = Duration::from_millis(50);

/// Looks for signals from time to time, while the interpreter is left to others.
pub struct Signals {
    last: Instant,
    /// What a signal's handler has raised.
    pub raised: Option<PyErr>,
}

impl Signals {
    pub fn new() -> Self {
        Signals { last: Instant::now(), raised: None }
    }

    /// Whether to go on.
    pub fn look(&mut self) -> ControlFlow<()> {
        if self.last.elapsed() < BETWEEN {
            return ControlFlow::Continue(());
        }
        self.last = Instant::now();
        match Python::attach(|py| py.check_signals()) {
            Ok(()) => ControlFlow::Continue(()),
            Err(raised) => {
                self.raised = Some(raised);
                ControlFlow::Break(())
            }
        }
    }
}
