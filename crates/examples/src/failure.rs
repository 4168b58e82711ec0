//! Errors of the binaries, and their exit codes.

use contact_geom::GeometryError;
use discrete_herglotz::sensitivity::SensitivityError;
use discrete_herglotz::{InputError, Status, StepError};
use exact_lagrangian::ExactError;
use formula_lagrangian::FormulaError;
use herglotz_fit::FitError;
use std::io;
use std::path::PathBuf;
use std::process::ExitCode;
use thiserror::Error;

/// An error that ends a binary.
#[derive(Debug, Error)]
pub enum Failure {
    /// The output cannot be written. Invalid input: exit code 2.
    #[error(
        "cannot write to {}: {cause}; --out must be a directory that exists or can be created, and in which files can \
         be written", .path.display()
    )]
    Output {
        /// The file or directory.
        path: PathBuf,
        /// The error of the operating system.
        cause: io::Error,
    },
    /// A name is not among those that are known. Invalid input: exit code 2.
    #[error("unknown {what} {name:?}; the known names are all, {known}")]
    Unknown {
        /// The kind of thing that has the name.
        what: &'static str,
        /// The name.
        name: String,
        /// The known names.
        known: String,
    },
    /// A table cannot be read, or its content is invalid. Invalid input: exit code 2.
    #[error("cannot read the rows of {}: {cause}; {expected}", .path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// The error in it.
        cause: String,
        /// The content that is accepted.
        expected: String,
    },
    /// The text for the terminal cannot be written: exit code 2.
    #[error("cannot write to the standard output: {0}")]
    Terminal(io::Error),
    /// A time step, an initial value or a count is invalid. Invalid input: exit code 2.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A point or a matrix is invalid. Invalid input: exit code 2.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// A run ended early; its results up to then are written. Exit code 1.
    #[error("the run of {what} ended early: {status}")]
    Run {
        /// The system.
        what: &'static str,
        /// How the run ended.
        status: Status,
    },
    /// A single step could not be taken: exit code 1.
    #[error("a step fails: {0}")]
    Step(#[from] StepError),
    /// A run cannot be differentiated: exit code 1.
    #[error(transparent)]
    Sensitivity(#[from] SensitivityError),
    /// A formula is invalid. Invalid input: exit code 2.
    #[error(transparent)]
    Formula(#[from] FormulaError),
    /// A fit has no result: exit code 1.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// An exact motion, or the motion between two points, was not found. The text is that of the error, whose type
    /// depends on the dimension. Exit code 1.
    #[error("the exact motion cannot be computed: {0}")]
    Exact(String),
    /// Statements of the paper, which are theorems, are violated: exit code 1.
    #[error("{count} of {total} checks of the paper's statements fail:\n{list}")]
    Statements {
        /// The number of failing checks.
        count: usize,
        /// The number of all checks.
        total: usize,
        /// One line for each failing check.
        list: String,
    },
    /// Figures are above their bounds: exit code 1.
    #[error("{count} of {total} figures are above their bounds:\n{list}")]
    Bounds {
        /// The number of figures above their bounds.
        count: usize,
        /// The number of all figures.
        total: usize,
        /// One line for each figure above its bound.
        list: String,
    },
}

impl<const N: usize> From<ExactError<N>> for Failure {
    fn from(error: ExactError<N>) -> Self {
        match error {
            ExactError::Input(cause) => Failure::Input(cause),
            other => Failure::Exact(other.to_string()),
        }
    }
}

impl Failure {
    /// The exit code: 2 for invalid input, 1 for a run or a check that failed.
    fn code(&self) -> u8 {
        match self {
            Failure::Output { .. }
            | Failure::Unknown { .. }
            | Failure::Table { .. }
            | Failure::Terminal(_)
            | Failure::Input(_)
            | Failure::Geometry(_)
            | Failure::Formula(_) => 2,
            Failure::Run { .. }
            | Failure::Step(_)
            | Failure::Sensitivity(_)
            | Failure::Fit(_)
            | Failure::Exact(_)
            | Failure::Statements { .. }
            | Failure::Bounds { .. } => 1,
        }
    }
}

/// Ends a binary: prints a failure on stderr and converts it to an exit code.
pub fn finish(result: Result<(), Failure>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::from(failure.code())
        }
    }
}
