//! Checkpoints, from which an interrupted run is resumed bitwise.

use crate::InputError;
use crate::run::{Observer, OutputRequest, StepView, Stop};
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Writes a checkpoint file at a fixed interval of steps. A run that was stopped or killed can be resumed from it with
/// bitwise the same result; compensated sums and predictors are part of the file. See
/// [`Run::resume`](crate::run::Run::resume).
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    every: usize,
    /// The error with which writing the last file failed; it ends the run.
    pub error: Option<std::io::Error>,
}

impl Checkpoint {
    /// Writes to a file every `steps` steps, and at the end of the run.
    ///
    /// # Errors
    /// [`InputError::Count`] for 0 steps.
    pub fn every(steps: usize, path: impl Into<PathBuf>) -> Result<Self, InputError> {
        if steps == 0 {
            return Err(InputError::Count { what: "the number of steps between two checkpoints", least: 1, found: 0 });
        }
        Ok(Checkpoint { path: path.into(), every: steps, error: None })
    }
}

impl Observer for Checkpoint {
    fn needs(&self) -> OutputRequest {
        OutputRequest { saved: true, ..OutputRequest::default() }
    }

    fn next(&self, taken: usize) -> usize {
        (taken / self.every + 1) * self.every
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if !at.ends_multiple_of(self.every) && !at.last {
            return ControlFlow::Continue(());
        }
        // The stepper can be saved; otherwise the run is refused at its start.
        match at.resume_state().map_or(Ok(()), |interrupted| interrupted.write(&self.path)) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.error = Some(error);
                ControlFlow::Break(Stop::here("a failure to write a checkpoint"))
            }
        }
    }
}
