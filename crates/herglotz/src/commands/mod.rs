//! The commands of the program, one file each.

mod run;

use crate::failure::Failure;
use clap::{Args, Subcommand};
use herglotz::Scene;
use std::path::PathBuf;

/// What is to be done.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Run the motion of a scene: rows.csv, events.csv, and where it leads.
    Run(run::Run),
}

impl Command {
    pub fn run(self) -> Result<(), Failure> {
        match self {
            Command::Run(command) => command.run(),
        }
    }
}

/// A scene file, with changes.
#[derive(Args)]
pub(crate) struct SceneArguments {
    /// The scene file.
    file: PathBuf,
    /// Change a value of the scene: a parameter, start.NAME, run.time, run.accuracy or run.step.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    changes: Vec<String>,
}

impl SceneArguments {
    /// Reads the scene.
    pub fn read(&self) -> Result<Scene, Failure> {
        let text = std::fs::read(&self.file).map_err(Failure::of_file(&self.file))?;
        let text = String::from_utf8(text)
            .map_err(|_| Failure::Input(format!("{} is not a text in UTF-8; save it as such", self.file.display())))?;
        Scene::read_with(&text, &self.changes).map_err(|error| self.explain(error))
    }

    /// An error with the name of the file.
    pub fn explain(&self, error: herglotz::SceneError) -> Failure {
        error.in_file(self.file.display().to_string()).into()
    }
}
