//! The scene file of a command.

use crate::failure::Failure;
use clap::{Args, ValueHint};
use herglotz::{AnyScene, BodyScene, Scene, SceneError};
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

/// A scene of one of the kinds that have plans, checks and sweeps.
pub(crate) enum FormulaOrBody {
    /// A system with a formula.
    Formula(Box<Scene>),
    /// A rigid body.
    Body(Box<BodyScene>),
}

impl SceneArguments {
    /// Reads the scene.
    pub fn read(&self) -> Result<Scene, Failure> {
        let folder = self.file.parent().unwrap_or(Path::new(""));
        Scene::read_in(&self.text()?, &self.changes, folder).map_err(|error| self.explain(error))
    }

    /// Reads the scene, of whatever kind.
    pub fn read_any(&self) -> Result<AnyScene, Failure> {
        let folder = self.file.parent().unwrap_or(Path::new(""));
        AnyScene::read_in(&self.text()?, &self.changes, folder).map_err(|error| self.explain(error))
    }

    /// Reads the scene of a system with a formula, or of a rigid body.
    pub fn read_formula_or_body(&self) -> Result<FormulaOrBody, Failure> {
        match self.read_any()? {
            AnyScene::Body(body) => Ok(FormulaOrBody::Body(body)),
            AnyScene::Motion(scene) => Ok(FormulaOrBody::Formula(scene)),
            // A lattice may be a formula as well; others are refused.
            AnyScene::Lattice(_) | AnyScene::Path(_) => {
                self.read().map(|scene| FormulaOrBody::Formula(Box::new(scene)))
            }
        }
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
