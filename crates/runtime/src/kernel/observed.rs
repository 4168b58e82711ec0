//! Recording of the members of an ensemble.

use super::recorder::{Crossings, rows};
use crate::{Column, Crossing, OutputTimes};
use discrete_herglotz::{InputError, Observer, OutputRequest, Row, Rows, RunInfo, StepView, Stop, Terminal};
use std::ops::ControlFlow;

/// The records of a member.
#[derive(Default)]
pub(super) struct MemberRecord {
    pub rows: Vec<Row>,
    /// The row at the end of the last step, where the conformal factor is requested, which is known only at the ends of
    /// steps.
    pub last: Option<Row>,
    pub crossings: Vec<Crossing>,
}

/// Observer that records a member.
pub(super) struct MemberObserver<'r> {
    rows: Option<Rows<'r>>,
    last: Option<Rows<'r>>,
    crossings: Option<Crossings<'r>>,
    found: Vec<Crossing>,
    forward: bool,
}

impl<'r> MemberObserver<'r> {
    pub fn new(
        when: Option<&OutputTimes>,
        columns: &[Column],
        crossings: Option<Crossings<'r>>,
    ) -> Result<Self, InputError> {
        let of_rows = when.map(|when| rows(when, columns)).transpose()?;
        let has_factor = columns.iter().any(Column::has_conformal_factor);
        let last = has_factor.then(|| rows(&OutputTimes::Every(usize::MAX), columns)).transpose()?;
        Ok(MemberObserver { rows: of_rows, last, crossings, found: Vec::new(), forward: true })
    }

    pub fn into_record(self) -> MemberRecord {
        let rows = self.rows.map(|rows| rows.rows).unwrap_or_default();
        MemberRecord { rows, last: self.last.and_then(|mut last| last.rows.pop()), crossings: self.found }
    }
}

impl Observer for MemberObserver<'_> {
    fn terminal(&self) -> Option<Terminal<'_>> {
        self.crossings.as_ref().and_then(Crossings::terminal)
    }

    fn needs(&self) -> OutputRequest {
        let of = |rows: &Option<Rows<'_>>| rows.as_ref().map(Observer::needs).unwrap_or_default();
        let of_events = self.crossings.as_ref().map(Crossings::needs).unwrap_or_default();
        of(&self.rows).and(of(&self.last)).and(of_events)
    }

    fn prepare(&mut self, run_info: &RunInfo) -> Result<(), InputError> {
        self.forward = run_info.t_end >= run_info.t0;
        for rows in self.rows.iter_mut().chain(&mut self.last) {
            rows.prepare(run_info)?;
        }
        self.crossings.as_mut().map_or(Ok(()), |crossings| crossings.prepare(run_info))
    }

    fn next(&self, taken: usize) -> usize {
        if self.crossings.is_some() {
            return taken + 1;
        }
        self.rows.as_ref().map_or(usize::MAX, |rows| rows.next(taken))
    }

    fn follows_rest(&mut self, _from: &StepView<'_>, _t_end: f64) -> bool {
        self.crossings.as_ref().is_some_and(Crossings::follows_rest)
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        for rows in self.rows.iter_mut().chain(&mut self.last) {
            rows.start(at)?;
        }
        self.crossings.as_mut().map_or(ControlFlow::Continue(()), |crossings| crossings.start(at))
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        for rows in self.rows.iter_mut().chain(&mut self.last) {
            rows.step(at)?;
        }
        let Some(crossings) = &mut self.crossings else { return ControlFlow::Continue(()) };
        let found = &mut self.found;
        let ended = crossings.step(at, |crossing| {
            found.push(crossing);
            ControlFlow::Continue(())
        });
        if let (ControlFlow::Break(Stop { at: Some((end, _)), .. }), Some(rows)) = (&ended, &mut self.rows) {
            // A terminal event ends the motion before the end of the step.
            let forward = self.forward;
            rows.rows.retain(|row| if forward { row.t <= *end } else { row.t >= *end });
        }
        ended
    }
}
