//! Stress test of the library's numerics on extreme problems.
//!
//! ```text
//! cargo run --release --bin stress [-- --case NAME|all --quick --out DIR]
//! ```
//!
//! Ten cases test the numerics where failures are most likely: growth of round-off, runs of 1e9 steps, strong damping,
//! tiny and huge numbers, singularities, features hidden between steps, chaos, conformality, solvers with poor initial
//! guesses, and whether a requested accuracy is kept. Each figure has a bound. A run that is flagged as unresolved,
//! stopped or refused is not a failure; a run that is completed without such a report and is wrong is one.
//!
//! Writes a table of each case, diagrams of some, `verdicts.csv` and `stability_tables.md` into `--out`. The CSV files
//! contain no measured times, so that they are the same in every run. The exit code is 1 if a figure is above its
//! bound, and 2 if a name is unknown or the output cannot be written.

mod accuracy;
mod chaos;
mod conformal;
mod damping;
mod formula;
mod hidden;
mod long_runs;
mod motion;
mod near_singular;
mod parallel;
mod probe;
mod random;
mod round_off;
mod scales;
mod solvers;
mod statistics;

use clap::Parser;
use contact_examples::{Case, CaseArguments, Failure, finish, print, progress_bar, run_cases};
use std::process::ExitCode;

/// Tests the numerics of the library on extreme problems.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    cases: CaseArguments,
    /// Makes one call that may not return; the case `solvers` runs it in a process of its own.
    #[arg(long, value_name = "CALL", hide = true)]
    probe: Option<String>,
}

const CASES: [Case; 10] = [
    ("round_off", "growth of the round-off of conserved quantities", round_off::run),
    ("long_runs", "1e9 steps, and decay to zero", long_runs::run),
    ("damping", "damping, stiffness and unequal masses", damping::run),
    ("scales", "tiny and huge steps, states and times", scales::run),
    ("near_singular", "motions near singularities", near_singular::run),
    ("hidden", "features between the steps", hidden::run),
    ("chaos", "runs forward and backward, and bitwise repetition", chaos::run),
    ("conformal", "conformality of long runs", conformal::run),
    ("solvers", "difficult problems for the solvers", solvers::run),
    ("accuracy", "whether the requested accuracy is reached", accuracy::run),
];

fn main() -> ExitCode {
    finish(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    if let Some(name) = &arguments.probe {
        return print(&probe::answer(name).unwrap_or_else(|| "unknown call".into()));
    }
    let bar = progress_bar("{msg:>14}", 1, "");
    // A panic that a case provokes is part of its result; one line on stderr suffices.
    let above = bar.clone();
    std::panic::set_hook(Box::new(move |panic| above.suspend(|| eprintln!("note: {panic}"))));
    run_cases("stress", &arguments.cases, &CASES, bar)
}
