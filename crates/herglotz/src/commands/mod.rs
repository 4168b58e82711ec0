//! The commands of the program, one file each.

mod check;
mod checkpoint;
mod compare;
mod ends;
mod lattice;
mod list;
mod new;
mod plan;
mod run;
mod sweep;

use crate::Program;
use crate::failure::Failure;
use crate::output::{print, print_json};
use clap::{Args, CommandFactory, Subcommand};
use clap_complete::Shell;
use herglotz::Scene;
use std::path::PathBuf;

/// The subcommands.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Run the motion of a scene, or find its path between two ends: writes rows.csv and events.csv, and prints the
    /// final state.
    Run(run::Run),
    /// Print what will be computed and what is skipped, and what is proved of the formula.
    Plan(plan::Plan),
    /// Check whether the motion is contact: conformal factors, momenta, Herglotz' equation, and the theorems of the
    /// discrete theory; the exit code is 1 if not.
    Check(check::Check),
    /// Measure run time against error for all integrators that apply, and for dop853 of another library: writes
    /// compare.csv, and draws the best dozen with dop853 in compare.svg.
    Compare(compare::Compare),
    /// Run all members of a sweep on several threads: writes sweep.csv.
    Sweep(sweep::Sweep),
    /// List the systems of the catalogue, or the integrators.
    List(list::List),
    /// Print a commented scene as a starting point.
    New(new::New),
    /// Print the completions for a shell.
    Completions {
        /// The shell.
        #[arg(value_enum)]
        shell: Shell,
    },
    /// Print the JSON schema of scene files, for editors.
    Schema,
}

impl Command {
    pub fn run(self) -> Result<(), Failure> {
        match self {
            Command::Run(command) => command.run(),
            Command::Plan(command) => command.run(),
            Command::Check(command) => command.run(),
            Command::Compare(command) => command.run(),
            Command::Sweep(command) => command.run(),
            Command::List(command) => command.run(),
            Command::New(command) => command.run(),
            Command::Completions { shell } => {
                let mut text = Vec::new();
                clap_complete::generate(shell, &mut Program::command(), "herglotz", &mut text);
                print(&String::from_utf8_lossy(&text))
            }
            Command::Schema => print_json(&herglotz::schema()),
        }
    }
}

/// A scene file, with overrides.
#[derive(Args)]
pub(crate) struct SceneArguments {
    /// The scene file.
    pub(crate) file: PathBuf,
    /// Override a value of the scene: a parameter, start.NAME, run.time, run.accuracy, run.step, run.steps or
    /// run.integrator.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub(crate) changes: Vec<String>,
}

impl SceneArguments {
    /// Reads the scene.
    pub fn read(&self) -> Result<Scene, Failure> {
        Scene::read_with(&self.text()?, &self.changes).map_err(|error| self.explain(error))
    }

    /// The text of the file.
    pub fn text(&self) -> Result<String, Failure> {
        let text = std::fs::read(&self.file).map_err(Failure::of_file(&self.file))?;
        String::from_utf8(text)
            .map_err(|_| Failure::Input(format!("{} is not encoded in UTF-8; save it in this encoding", self.file.display())))
    }

    /// An error with the name of the file.
    pub fn explain(&self, error: herglotz::SceneError) -> Failure {
        error.in_file(self.file.display().to_string()).into()
    }
}
