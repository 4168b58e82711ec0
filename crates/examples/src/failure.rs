//! Errors of the binaries, and their exit codes.

use contact_geom::GeometryError;
use discrete_herglotz::{InputError, StepError};
use exact_lagrangian::ExactError;
use formula_lagrangian::FormulaError;
use sparse_herglotz::SparseError;
use std::fmt::Display;
use std::path::Path;
use std::process::ExitCode;
use thiserror::Error;

/// An error that ends a binary.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{text}")]
pub struct Failure {
    text: String,
    /// The exit code: 2 for invalid input, 1 for a run or a check that failed.
    code: u8,
}

impl Failure {
    /// Invalid input, or an output that cannot be written: exit code 2.
    pub fn input(text: impl Display) -> Self {
        Failure { text: text.to_string(), code: 2 }
    }

    /// A run that has no result: exit code 1.
    pub fn run(text: impl Display) -> Self {
        Failure { text: text.to_string(), code: 1 }
    }

    /// An exact motion, a motion of a large system, or the motion between two points that was not found: exit code 1.
    pub fn motion(cause: impl Display) -> Self {
        Self::run(format_args!("the exact motion cannot be computed: {cause}"))
    }

    /// A file or directory that cannot be written.
    pub fn output(path: &Path, cause: impl Display) -> Self {
        Self::input(format_args!(
            "cannot write to {}: {cause}; --out must be a directory that exists or can be created, and in which files \
             can be written",
            path.display()
        ))
    }

    /// A text for the terminal that cannot be written, or the text of another program that cannot be read.
    pub fn terminal(cause: impl Display) -> Self {
        Self::input(format_args!("cannot write to the standard output: {cause}"))
    }

    /// `Ok` if the list of what is wrong is empty, otherwise a failure with one line for each entry: exit code 1.
    ///
    /// # Errors
    /// Where `wrong` has an entry.
    pub fn unless_empty(wrong: &[String], total: usize, what: &str) -> Result<(), Self> {
        if wrong.is_empty() {
            return Ok(());
        }
        Err(Self::run(format_args!("{} of {total} {what}:\n{}", wrong.len(), wrong.join("\n"))))
    }
}

/// An error of a library as invalid input.
macro_rules! invalid_input {
    ($($error:ty),*) => { $(
        impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Failure::input(error)
            }
        }
    )* };
}
invalid_input!(InputError, GeometryError, FormulaError);

impl From<StepError> for Failure {
    fn from(error: StepError) -> Self {
        Failure::run(format_args!("a step fails: {error}"))
    }
}

impl<const N: usize> From<ExactError<N>> for Failure {
    fn from(error: ExactError<N>) -> Self {
        match error {
            ExactError::Input(cause) => cause.into(),
            other => Failure::motion(other),
        }
    }
}

impl From<SparseError> for Failure {
    fn from(error: SparseError) -> Self {
        match error {
            SparseError::Input(cause) => cause.into(),
            other => Failure::motion(other),
        }
    }
}

/// Ends a binary: prints a failure on stderr and converts it to an exit code.
pub fn finish(result: Result<(), Failure>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::from(failure.code)
        }
    }
}
