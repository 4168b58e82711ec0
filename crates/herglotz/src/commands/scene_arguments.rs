//! The scene file of a command.

use crate::failure::Failure;
use clap::{Args, ValueHint};
use herglotz::{BodyScene, Scene, SceneError};
use std::path::{Path, PathBuf};

/// A scene file, with overrides.
#[derive(Args)]
pub(crate) struct SceneArguments {
    /// The scene file.
    #[arg(value_hint = ValueHint::FilePath)]
    pub(crate) file: PathBuf,
    /// Override a value of the scene: a parameter, start.NAME, run.time, run.accuracy, run.step, run.steps or
    /// run.integrator; for a rigid body mass, gamma, inertia1, inertia=[1.0, 2.0, 3.0], start.omega1 and others.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub(crate) changes: Vec<String>,
}

impl SceneArguments {
    /// Reads the scene.
    pub fn read(&self) -> Result<Scene, Failure> {
        let folder = self.file.parent().unwrap_or(Path::new(""));
        Scene::read_in(&self.text()?, &self.changes, folder).map_err(|error| self.explain(error))
    }

    /// Reads the scene of a rigid body from its text.
    pub fn read_body(&self, text: &str) -> Result<BodyScene, Failure> {
        BodyScene::read_with(text, &self.changes).map_err(|error| self.explain(error))
    }

    /// The text of the file.
    pub fn text(&self) -> Result<String, Failure> {
        let text = std::fs::read(&self.file).map_err(Failure::of_file(&self.file))?;
        String::from_utf8(text).map_err(|_| {
            Failure::Input(format!("{} is not encoded in UTF-8; save it in this encoding", self.file.display()))
        })
    }

    /// An error with the name of the file.
    pub fn explain(&self, error: SceneError) -> Failure {
        error.in_file(self.file.display().to_string()).into()
    }
}
