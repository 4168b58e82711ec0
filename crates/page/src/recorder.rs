//! Rows and events while a motion is computed.

use crate::host;
use crate::numbers::number;
use crate::request::Deadline;
use herglotz::runtime::{Crossing, RunMonitor};
use serde_json::Value;
use std::ops::ControlFlow;

/// The time between two passes of rows to the host, in milliseconds: for the eye of a user.
const BETWEEN_PASSES: f64 = 60.0;

/// The maximal number of events that are kept.
const MOST_EVENTS: usize = 20_000;

/// Passes the rows of a motion on, keeps its events, and ends it at the deadline.
pub struct Recorder<'e> {
    deadline: Deadline,
    passed: f64,
    numbers: Vec<f64>,
    /// The number of rows.
    pub rows: usize,
    /// The numbers of each event.
    pub events: Vec<Value>,
    /// The number of events, those that are not kept included.
    pub count: usize,
    /// Whether the motion was ended at the deadline.
    pub is_over: bool,
    of_event: &'e dyn Fn(&Crossing) -> Vec<Option<f64>>,
}

impl<'e> Recorder<'e> {
    pub fn new(deadline: Deadline, of_event: &'e dyn Fn(&Crossing) -> Vec<Option<f64>>) -> Self {
        let (numbers, events) = (Vec::new(), Vec::new());
        Recorder { deadline, passed: host::now(), numbers, rows: 0, events, count: 0, is_over: false, of_event }
    }

    /// Passes on the rows that are left.
    pub fn finish(&mut self) {
        host::rows(&self.numbers);
        self.numbers.clear();
    }
}

impl RunMonitor for Recorder<'_> {
    fn row(&mut self, numbers: &[f64]) -> ControlFlow<()> {
        self.rows += 1;
        self.numbers.extend(numbers);
        ControlFlow::Continue(())
    }

    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        self.count += 1;
        if self.count <= MOST_EVENTS {
            let numbers = (self.of_event)(crossing).into_iter().map(|x| x.map_or(Value::Null, number));
            self.events.push([Value::from(crossing.event)].into_iter().chain(numbers).collect());
        }
        ControlFlow::Continue(())
    }

    fn poll(&mut self, _part: f64) -> ControlFlow<()> {
        let now = host::now();
        if now - self.passed > BETWEEN_PASSES {
            self.passed = now;
            self.finish();
        }
        self.is_over = self.deadline.is_over();
        if self.is_over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
