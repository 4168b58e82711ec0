//! How the program ends where it does not succeed.

use herglotz::SceneError;
use std::process::ExitCode;
use thiserror::Error;

/// Why a command did not succeed.
#[derive(Debug, Error)]
pub(crate) enum Failure {
    /// Something is wrong with the scene.
    #[error("{0}")]
    Scene(#[from] SceneError),
    /// Something else is wrong with what the user gave.
    #[error("{0}")]
    Input(String),
    /// The motion did not end well; what is wrong was told.
    #[error("{0}")]
    Run(String),
    /// A file cannot be read or written.
    #[error("{path}: {cause}")]
    File {
        /// The file.
        path: String,
        /// Why.
        cause: std::io::Error,
    },
    /// The output cannot be written.
    #[error("the output cannot be written: {0}")]
    Output(#[from] std::io::Error),
}

impl Failure {
    /// Of a file.
    pub fn of_file(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Failure {
        let path = path.display().to_string();
        move |cause| Failure::File { path, cause }
    }

    /// Tells it, and how the program ends: 1 of a run, 2 of input.
    pub fn tell(&self) -> ExitCode {
        // Who reads the output has closed it: nothing is wrong.
        if matches!(self, Failure::Output(cause) if cause.kind() == std::io::ErrorKind::BrokenPipe) {
            return ExitCode::SUCCESS;
        }
        eprintln!("error: {self}");
        ExitCode::from(if matches!(self, Failure::Run(_)) { 1 } else { 2 })
    }
}
