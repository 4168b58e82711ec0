//! Motions of action-dependent Lagrangians, from scene files.

mod commands;
mod failure;
mod output;
mod peer;
mod plot;
mod plot_body;
mod plot_fit;

use clap::Parser;
use commands::Program;
use std::process::ExitCode;

fn main() -> ExitCode {
    match Program::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.report(),
    }
}
