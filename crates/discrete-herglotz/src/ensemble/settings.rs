//! The settings of an ensemble.

use crate::Interrupt;
use crate::ensemble::error::EnsembleError;
use crate::numbers::instructions::Instructions;
use std::num::NonZeroUsize;
use std::path::PathBuf;

/// The largest number of members of an ensemble that get all checks of a run before it starts: errors that all members
/// share, or that depend on the index, show in them, and the checks of all members would cost as much as their steps.
const MAX_CHECKED_MEMBERS: usize = 4;

/// The settings of an ensemble beside its members, their integrator and its steps.
pub(crate) struct Settings<'a> {
    /// Whether all members have one Lagrangian.
    pub shared: bool,
    pub count: usize,
    pub action: bool,
    /// The number of steps from one recorded row to the next.
    pub rows: Option<usize>,
    pub check_resolution: bool,
    pub threads: Option<usize>,
    pub instructions: Instructions,
    pub checkpoint: Option<PathBuf>,
    pub interrupt: Option<Interrupt<'a>>,
    pub progress: Option<Box<dyn Fn(f64) + 'a>>,
}

impl Settings<'_> {
    /// The default settings for a number of members.
    pub fn new(count: usize) -> Self {
        Settings {
            shared: false,
            count,
            action: true,
            rows: None,
            check_resolution: true,
            threads: None,
            instructions: Instructions::new(),
            checkpoint: None,
            interrupt: None,
            progress: None,
        }
    }

    /// Reports how many of the shards are completed.
    pub fn report_progress(&self, done: usize, shards: usize) {
        if let Some(report) = &self.progress {
            report(done as f64 / shards as f64);
        }
    }

    /// The number of threads; at least one.
    pub fn some_threads(&self) -> Result<usize, EnsembleError> {
        let processors = || std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
        match self.threads.unwrap_or_else(processors) {
            0 => Err(EnsembleError::Threads),
            threads => Ok(threads),
        }
    }

    /// Members distributed over the ensemble, among them the first and the last.
    pub fn sample(&self) -> impl Iterator<Item = usize> + use<> {
        let (count, sample) = (self.count, self.count.min(MAX_CHECKED_MEMBERS));
        (0..sample).map(move |i| i * (count - 1) / (sample - 1).max(1))
    }
}
