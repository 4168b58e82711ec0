//! The rows and events of a run: their files, progress, interruption and checkpoints.

use super::checkpoint::{Checkpoint, CheckpointWriter, Written};
use crate::failure::Failure;
use crate::output::{Directory, Table};
use herglotz::runtime::{BodyResumeState, Crossing, ResumeState, RunMonitor};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

pub(super) const ROWS: &str = "rows.csv";
pub(crate) const EVENTS: &str = "events.csv";

/// The files of a run: the columns of rows.csv, and those of events.csv where there are events.
pub(super) struct Headers {
    pub rows: Vec<String>,
    pub events: Option<Vec<String>>,
}

/// Observes a motion and writes its output.
pub(super) struct RunWriter<'s> {
    rows: Table,
    /// The table of events, where there are events.
    events: Option<Table>,
    /// The columns that are written, by their numbers in a row; all of them where it is `None`.
    pub columns: Option<&'s [usize]>,
    /// The row of events.csv of a sign change.
    pub row_of_event: &'s dyn Fn(&Crossing) -> Vec<String>,
    row_count: usize,
    event_count: usize,
    /// For each written column the number of rows in which it is not finite.
    not_finite: Vec<usize>,
    /// Whether the next row is already in the file.
    pub skip: bool,
    /// The rows with all columns, where they are kept for figures.
    pub kept: Option<Vec<Vec<f64>>>,
    bar: ProgressBar,
    stop: Arc<AtomicBool>,
    /// The fraction of the run at which it is interrupted: for tests.
    pub interrupt_at: Option<f64>,
    /// The state of an interrupted run, as bytes.
    interrupted: Option<Vec<u8>>,
    /// The checkpoints, where the run can be resumed.
    pub checkpoints: Option<CheckpointWriter>,
    failure: Option<Failure>,
}

/// What a run has written.
pub(super) struct RunOutput {
    /// The numbers of rows and events, those before a resume included.
    pub rows: usize,
    pub events: usize,
    /// For each written column the number of rows in which it is not finite.
    pub not_finite: Vec<usize>,
    /// The rows that were kept.
    pub kept: Option<Vec<Vec<f64>>>,
    /// Whether the run was interrupted and can be resumed.
    pub is_resumable: bool,
}

/// No event is written.
fn no_events(_: &Crossing) -> Vec<String> {
    Vec::new()
}

impl<'s> RunWriter<'s> {
    /// The files in a directory: new ones, or those of the run that is resumed.
    pub fn new(
        directory: &Directory,
        headers: &Headers,
        saved: Option<&Checkpoint>,
        shows_progress: bool,
    ) -> Result<Self, Failure> {
        directory.create()?;
        let (rows_at, events_at) = (directory.file(ROWS), directory.file(EVENTS));
        let table = |path, header: &[String]| Table::new(path, header.iter().map(String::as_str));
        let before = saved.map(|saved| saved.written);
        let (rows, events) = match before {
            Some(before) => {
                let events =
                    headers.events.as_ref().map(|_| Table::resume(events_at, before.events_bytes)).transpose()?;
                (Table::resume(rows_at, before.rows_bytes)?, events)
            }
            None => {
                let events = headers.events.as_ref().map(|header| table(events_at, header)).transpose()?;
                (table(rows_at, &headers.rows)?, events)
            }
        };
        let before = before.unwrap_or_default();
        Ok(RunWriter {
            rows,
            events,
            columns: None,
            row_of_event: &no_events,
            row_count: before.rows,
            event_count: before.events,
            not_finite: vec![0; headers.rows.len()],
            skip: false,
            kept: None,
            bar: progress_bar(shows_progress),
            stop: interrupt_flag(),
            interrupt_at: None,
            interrupted: None,
            checkpoints: None,
            failure: None,
        })
    }

    /// Flushes the files and returns their lengths.
    fn written(&mut self) -> Result<Written, Failure> {
        let rows_bytes = self.rows.flush()?;
        let events_bytes = self.events.as_mut().map(Table::flush).transpose()?.unwrap_or(0);
        Ok(Written { rows: self.row_count, rows_bytes, events: self.event_count, events_bytes })
    }

    fn continue_unless_failed(&mut self, written: Result<(), Failure>) -> ControlFlow<()> {
        match written {
            Ok(()) => ControlFlow::Continue(()),
            Err(failure) => {
                self.failure = Some(failure);
                ControlFlow::Break(())
            }
        }
    }

    fn save(&mut self, taken: usize, state: &[u8]) -> ControlFlow<()> {
        let saved = self.written().and_then(|written| match &mut self.checkpoints {
            Some(checkpoints) => checkpoints.save(taken, written, state),
            None => Ok(()),
        });
        self.continue_unless_failed(saved)
    }

    /// Ends the progress bar, before anything is printed.
    pub fn end_progress(&self) {
        self.bar.finish_and_clear();
    }

    /// Completes the files after a number of steps. The checkpoint of an interrupted run is saved, and that of a run
    /// that has ended is removed.
    pub fn finish(mut self, directory: &Directory, taken: usize) -> Result<RunOutput, Failure> {
        let written = self.written()?;
        let RunWriter { not_finite, kept, interrupted, checkpoints, failure, .. } = self;
        if let Some(failure) = failure {
            return Err(failure);
        }
        let is_resumable = interrupted.is_some() && checkpoints.is_some();
        match (checkpoints, interrupted) {
            (Some(mut checkpoints), Some(state)) => checkpoints.save(taken, written, &state)?,
            (Some(_), None) => Checkpoint::remove(directory)?,
            (None, _) => {}
        }
        Ok(RunOutput { rows: written.rows, events: written.events, not_finite, kept, is_resumable })
    }
}

impl RunMonitor for RunWriter<'_> {
    fn row(&mut self, numbers: &[f64]) -> ControlFlow<()> {
        if std::mem::take(&mut self.skip) {
            return ControlFlow::Continue(());
        }
        self.row_count += 1;
        if let Some(kept) = &mut self.kept {
            kept.push(numbers.to_vec());
        }
        let chosen: Vec<f64>;
        let numbers = match self.columns {
            None => numbers,
            Some(columns) => {
                chosen = columns.iter().filter_map(|k| numbers.get(*k).copied()).collect();
                &chosen
            }
        };
        for (count, x) in self.not_finite.iter_mut().zip(numbers) {
            *count += usize::from(!x.is_finite());
        }
        let written = self.rows.numbers(numbers);
        self.continue_unless_failed(written)
    }

    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        let Some(table) = &mut self.events else { return ControlFlow::Continue(()) };
        self.event_count += 1;
        let written = table.record((self.row_of_event)(crossing));
        self.continue_unless_failed(written)
    }

    fn poll(&mut self, part: f64) -> ControlFlow<()> {
        self.bar.set_position((part * 1000.0) as u64);
        // At the end of the motion an interruption has no effect.
        let is_interrupted = self.stop.load(Ordering::Relaxed) || self.interrupt_at.is_some_and(|at| part >= at);
        if is_interrupted && part < 1.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn interrupted(&mut self, at: ResumeState) {
        self.interrupted = Some(at.to_bytes());
    }

    fn wants_checkpoint(&mut self) -> bool {
        self.checkpoints.as_ref().is_some_and(CheckpointWriter::is_due)
    }

    fn checkpoint(&mut self, taken: usize, at: ResumeState) -> ControlFlow<()> {
        self.save(taken, &at.to_bytes())
    }

    fn body_interrupted(&mut self, at: BodyResumeState) {
        self.interrupted = Some(at.to_bytes());
    }

    fn body_checkpoint(&mut self, taken: usize, at: BodyResumeState) -> ControlFlow<()> {
        self.save(taken, &at.to_bytes())
    }
}

/// A flag that Ctrl-C sets; a second one ends the program.
pub(crate) fn interrupt_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let set = flag.clone();
    let handler = move || {
        if set.swap(true, Ordering::Relaxed) {
            std::process::exit(1);
        }
    };
    // Without a handler Ctrl-C ends the program at once.
    if let Err(error) = ctrlc::set_handler(handler) {
        eprintln!("warning: a run that Ctrl-C interrupts will have no checkpoint: {error}");
    }
    flag
}

/// A progress bar in thousandths, on a terminal.
pub(crate) fn progress_bar(shown: bool) -> ProgressBar {
    if !(shown && std::io::stderr().is_terminal()) {
        return ProgressBar::hidden();
    }
    let style =
        ProgressStyle::with_template("{wide_bar} {percent}% {eta}").unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(1000).with_style(style)
}
