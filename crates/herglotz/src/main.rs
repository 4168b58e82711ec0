//! Motions of action-dependent Lagrangians, from scene files.

mod commands;
mod failure;
mod output;
mod peer;
mod plot;

use clap::Parser;
use commands::Command;
use std::process::ExitCode;

/// Contact mechanics from scene files: runs, plans, checks, comparisons and parameter sweeps of solutions of Herglotz'
/// equation.
///
/// Begin with `herglotz new pendulum > pendulum.toml` and `herglotz run pendulum.toml`.
#[derive(Parser)]
#[command(name = "herglotz", version, about)]
pub(crate) struct Program {
    #[command(subcommand)]
    command: Command,
}

fn main() -> ExitCode {
    match Program::parse().command.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.tell(),
    }
}
