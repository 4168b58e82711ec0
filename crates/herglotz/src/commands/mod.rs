//! The commands of the program, one file each.

mod body;
mod body_sweep;
mod check;
mod checkpoint;
mod compare;
mod completions;
mod ends;
mod fit;
mod lattice;
mod list;
mod lyapunov;
mod migrate;
mod modified;
mod new;
mod plan;
mod run;
mod run_writer;
mod scene_arguments;
mod sweep;
mod sweep_writer;

use crate::failure::Failure;
use crate::output::{print, print_json};
use clap::{CommandFactory, Parser, Subcommand};
use clap_complete::Shell;

/// Contact mechanics from scene files: runs, plans, checks, comparisons, parameter sweeps and fits of solutions of Herglotz'
/// equation.
///
/// Begin with `herglotz new pendulum > pendulum.toml` and `herglotz run pendulum.toml`.
#[derive(Parser)]
#[command(name = "herglotz", version, about)]
pub(crate) struct Program {
    #[command(subcommand)]
    command: Command,
}

impl Program {
    /// Runs the command.
    pub fn run(self) -> Result<(), Failure> {
        self.command.run()
    }
}

/// The subcommands.
#[derive(Subcommand)]
pub(crate) enum Command {
    /// Run the motion of a scene, or find its path between two ends: writes rows.csv and events.csv, and prints the
    /// final state.
    Run(run::Run),
    /// Print what will be computed and what is skipped, and which properties of the formula are proved.
    Plan(plan::Plan),
    /// Check whether the motion is contact: conformal factors, momenta, Herglotz' equation, and the theorems of the
    /// discrete theory; the exit code is 1 if not. With a force, check that the defect is its virtual work.
    Check(check::Check),
    /// Measure run time against error for all integrators that apply, and for dop853 of another library: writes
    /// compare.csv, and draws the best dozen with dop853 in compare.svg.
    Compare(compare::Compare),
    /// Run all members of a sweep on several threads: writes sweep.csv.
    Sweep(sweep::Sweep),
    /// Fit parameters and the initial state to data: writes fit.csv and residuals.csv, and prints the fitted values with
    /// their standard errors and correlations.
    Fit(fit::Fit),
    /// List the systems of the catalogue, or the integrators.
    List(list::List),
    /// Print a commented scene as a starting point.
    New(new::New),
    /// Translate scene files of an older version of the format, with their comments.
    Migrate(migrate::Migrate),
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
            Command::Fit(command) => command.run(),
            Command::List(command) => command.run(),
            Command::New(command) => command.run(),
            Command::Migrate(command) => command.run(),
            Command::Completions { shell } => print(&completions::text(shell, &Program::command())),
            Command::Schema => print_json(&herglotz::schema()),
        }
    }
}
