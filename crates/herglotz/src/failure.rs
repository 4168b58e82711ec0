//! Errors of the program and its exit codes.

use herglotz::SceneError;
use std::process::ExitCode;
use thiserror::Error;

/// The reason for which a command failed.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    /// The scene is invalid.
    #[error("{0}")]
    Scene(#[from] SceneError),
    /// Another input of the user is invalid.
    #[error("{0}")]
    Input(String),
    /// The motion failed or was interrupted; its output has been written.
    #[error("{0}")]
    Run(String),
    /// A file cannot be read or written.
    #[error("{path}: {cause}")]
    File {
        /// The file.
        path: String,
        /// The cause.
        cause: std::io::Error,
    },
    /// The output cannot be written.
    #[error("the output cannot be written: {0}")]
    Output(#[from] std::io::Error),
}

impl Failure {
    /// The error of a file.
    pub fn of_file(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Failure {
        let path = path.display().to_string();
        move |cause| Failure::File { path, cause }
    }

    /// Prints the error, and returns the exit code: 1 for a run, 2 for input.
    pub fn report(&self) -> ExitCode {
        // A reader that closes the output early is not an error.
        if matches!(self, Failure::Output(cause) if cause.kind() == std::io::ErrorKind::BrokenPipe) {
            return ExitCode::SUCCESS;
        }
        eprintln!("error: {self}");
        ExitCode::from(if matches!(self, Failure::Run(_)) { 1 } else { 2 })
    }
}
