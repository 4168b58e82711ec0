//! Checkpoints: a run that is interrupted goes on as if it had not been.

use crate::InputError;
use crate::run::{Observer, OutputRequest, StepView, Stop};
use std::ops::ControlFlow;
use std::path::PathBuf;

/// Writes a file every so many steps from which the run can go on to the last bit, compensations and extrapolated starts included, after
/// it was stopped or killed; see [`Run::resume`](crate::run::Run::resume).
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    every: usize,
    /// Why the last file could not be written; the run then ends.
    pub error: Option<std::io::Error>,
}

impl Checkpoint {
    /// To a file, every so many steps and at the end.
    ///
    /// # Errors
    /// [`InputError::Count`] for 0 steps.
    pub fn every(steps: usize, path: impl Into<PathBuf>) -> Result<Self, InputError> {
        if steps == 0 {
            return Err(InputError::Count { what: "the steps between two checkpoints", least: 1, found: 0 });
        }
        Ok(Checkpoint { path: path.into(), every: steps, error: None })
    }
}

impl<const N: usize> Observer<N> for Checkpoint {
    fn needs(&self) -> OutputRequest {
        OutputRequest { saved: true, ..OutputRequest::default() }
    }

    fn next(&self, taken: usize) -> usize {
        (taken / self.every + 1) * self.every
    }

    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        if !at.k.is_multiple_of(self.every) && !at.last {
            return ControlFlow::Continue(());
        }
        // Its stepper can be saved, or the run would not have begun.
        match at.resume_state().map_or(Ok(()), |interrupted| interrupted.write(&self.path)) {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.error = Some(error);
                ControlFlow::Break(Stop::here("a checkpoint that could not be written"))
            }
        }
    }
}
