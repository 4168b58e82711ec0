//! The tables of a sweep: a row for each member, and the sign changes of its events.

use super::run_writer::{EVENTS, interrupt_flag, progress_bar};
use crate::failure::Failure;
use crate::output::{Directory, Table, exact};
use herglotz::{Combinations, SweptQuantity};
use indicatif::ProgressBar;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The columns of sweep.csv between the swept values and the columns at the end.
const OF_END: [&str; 4] = ["status", "why", "steps", "t"];

/// A swept value with the numbers that are drawn against it.
pub(super) type Drawn = (f64, Vec<f64>);

/// The end of a member's motion.
pub(super) struct MemberEndRow {
    /// Its status in one word, and the reason.
    pub status: (&'static str, String),
    pub steps: usize,
    pub t: f64,
    /// The columns at the end, except the time.
    pub columns: Vec<f64>,
}

/// A member as it is written.
pub(super) struct MemberRow {
    pub index: usize,
    /// The end; the reason where the motion could not start.
    pub end: Result<MemberEndRow, String>,
    /// The sign changes of events: the name of the event, and its numbers.
    pub events: Vec<Vec<String>>,
    /// The numbers that are drawn of each sign change of the first event.
    pub first_event: Vec<Vec<f64>>,
}

/// Writes the members in the order of their index.
pub(super) struct SweepWriter<'s> {
    members: Combinations<'s>,
    csv: Table,
    /// The table of events, where there are events.
    events: Option<Table>,
    /// The number of columns at the end.
    columns: usize,
    /// The data of the figures: the columns at the end of each member that started, and the numbers at each sign change
    /// of the first event, both with the swept value.
    drawn: Option<[Vec<Drawn>; 2]>,
    bar: ProgressBar,
    pub stop: Arc<AtomicBool>,
    written: usize,
    failure: Option<Failure>,
}

/// What a sweep has written.
pub(super) struct SweepOutput {
    /// The number of members.
    pub members: usize,
    /// Whether the sweep was interrupted.
    pub is_interrupted: bool,
    /// The data of the figures.
    pub drawn: [Vec<Drawn>; 2],
}

impl<'s> SweepWriter<'s> {
    /// The files in a directory: sweep.csv with columns at the end, and events.csv with columns where there are events.
    pub fn new(
        directory: &Directory,
        members: Combinations<'s>,
        columns: &[&str],
        events: Option<&[String]>,
        (draws, shows_progress): (bool, bool),
    ) -> Result<Self, Failure> {
        let quantity = |quantity: &'s SweptQuantity| quantity.name.as_str();
        let swept: Vec<&str> = ["index"].into_iter().chain(members.swept().iter().map(quantity)).collect();
        let swept = || swept.iter().copied();
        directory.create()?;
        let csv = Table::new(directory.file("sweep.csv"), swept().chain(OF_END).chain(columns.iter().copied()))?;
        let of_events =
            |names: &[String]| Table::new(directory.file(EVENTS), swept().chain(names.iter().map(String::as_str)));
        Ok(SweepWriter {
            members,
            csv,
            events: events.map(of_events).transpose()?,
            columns: columns.len(),
            drawn: draws.then(Default::default),
            bar: progress_bar(shows_progress),
            stop: interrupt_flag(),
            written: 0,
            failure: None,
        })
    }

    /// Writes a member; `Break` where it cannot be written, and where the sweep is interrupted.
    pub fn member(&mut self, member: MemberRow) -> ControlFlow<()> {
        let written = self.write(member);
        self.written += 1;
        self.bar.set_position((1000 * self.written / self.members.count().max(1)) as u64);
        match written {
            _ if self.stop.load(Ordering::Relaxed) => ControlFlow::Break(()),
            Ok(()) => ControlFlow::Continue(()),
            Err(failure) => {
                self.failure = Some(failure);
                ControlFlow::Break(())
            }
        }
    }

    fn write(&mut self, member: MemberRow) -> Result<(), Failure> {
        let MemberRow { index, end, events, first_event } = member;
        let values = self.members.values(index);
        let which: Vec<String> = [index.to_string()].into_iter().chain(values.iter().map(|x| exact(*x))).collect();
        let mut row = which.clone();
        match end {
            Ok(MemberEndRow { status: (status, why), steps, t, columns }) => {
                row.extend([status.to_owned(), why, steps.to_string(), exact(t)]);
                row.extend(columns.iter().map(|x| exact(*x)));
                if let (Some([ends, of_events]), Some(value)) = (&mut self.drawn, values.first()) {
                    ends.push((*value, columns));
                    of_events.extend(first_event.into_iter().map(|numbers| (*value, numbers)));
                }
            }
            Err(cause) => {
                row.extend(["refused".to_owned(), cause, "0".to_owned(), String::new()]);
                row.extend(std::iter::repeat_n(String::new(), self.columns));
            }
        }
        self.csv.record(&row)?;
        if let Some(table) = &mut self.events {
            for event in events {
                table.record(which.iter().chain(&event))?;
            }
        }
        Ok(())
    }

    /// Ends the progress bar, before anything is printed.
    pub fn end_progress(&self) {
        self.bar.finish_and_clear();
    }

    /// Completes the files.
    pub fn finish(self) -> Result<SweepOutput, Failure> {
        let SweepWriter { members, csv, events, drawn, stop, written, failure, .. } = self;
        csv.finish()?;
        events.map(Table::finish).transpose()?;
        if let Some(failure) = failure {
            return Err(failure);
        }
        let is_interrupted = stop.load(Ordering::Relaxed) && written < members.count();
        Ok(SweepOutput { members: written, is_interrupted, drawn: drawn.unwrap_or_default() })
    }
}
