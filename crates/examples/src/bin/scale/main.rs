//! Run time and peak memory of large problems against their size.
//!
//! ```text
//! cargo run --release --bin scale [-- --case NAME|all --quick --out DIR]
//! ```
//!
//! Each case runs increasing sizes, and its figures are compared with bounds: hand-written loops, a copy of the memory
//! that is touched, other programs, and a log-log slope of one. Both sides of a comparison are measured in the same
//! run, except for tabulated times of other programs.
//!
//! Writes `scale.csv` (times and peak memory), log-log diagrams of each case, and `verdicts.csv` (figures with their
//! bounds) into `--out`. The exit code is 1 if a figure is above its bound, and 2 if a name is unknown or the output
//! cannot be written.

mod chain;
mod ensembles;
mod lattice;
mod memory;
mod path;
mod peer;
mod rods;
mod seconds;
mod solar;
mod sparse_path;

use clap::Parser;
use contact_examples::{Case, CaseArguments, finish, run_cases};
use indicatif::ProgressBar;
use std::process::ExitCode;

/// Measures time and memory against size.
#[derive(Parser)]
struct Arguments {
    #[command(flatten)]
    cases: CaseArguments,
}

const CASES: &[Case] = &[
    ("path", "steps", path::run),
    ("chain", "unknowns", chain::run),
    ("lattice", "unknowns", lattice::run),
    ("rods", "links", rods::run),
    ("solar", "years", solar::run),
    ("ensembles", "members", ensembles::run),
];

fn main() -> ExitCode {
    finish(run_cases("scale", &Arguments::parse().cases, CASES, ProgressBar::hidden()))
}
