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
mod report;
mod rods;
mod seconds;
mod solar;
mod sparse_path;

use clap::Parser;
use contact_examples::{Directory, Failure, finish};
use report::Report;
use std::path::PathBuf;
use std::process::ExitCode;

/// Measures time and memory against size.
#[derive(Parser)]
struct Arguments {
    /// The cases, separated by commas.
    #[arg(long, value_name = "NAME", value_delimiter = ',', default_value = "all")]
    case: Vec<String>,
    /// Small sizes only.
    #[arg(long)]
    quick: bool,
    /// The directory for tables and figures; created where it does not exist.
    #[arg(long, value_name = "DIR", default_value = "out/scale")]
    out: PathBuf,
}

/// A case: its name, the meaning of its sizes, and the function that runs it.
type Case = (&'static str, &'static str, fn(&mut Report) -> Result<(), Failure>);

const CASES: &[Case] = &[
    ("path", "steps", path::run),
    ("chain", "unknowns", chain::run),
    ("lattice", "unknowns", lattice::run),
    ("rods", "links", rods::run),
    ("solar", "years", solar::run),
    ("ensembles", "members", ensembles::run),
];

fn main() -> ExitCode {
    finish(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let names: Vec<&str> = CASES.iter().map(|(name, ..)| *name).collect();
    let unknown = |name: &&String| name.as_str() != "all" && !names.contains(&name.as_str());
    if let Some(name) = arguments.case.iter().find(unknown) {
        return Err(Failure::Unknown { what: "case", name: name.clone(), known: names.join(", ") });
    }
    let mut report = Report::new(Directory::create(&arguments.out)?);
    report.quick = arguments.quick;
    for (name, size, case) in CASES {
        if arguments.case.iter().any(|requested| requested == "all" || requested == name) {
            report.begin(name, size);
            case(&mut report)?;
        }
    }
    report.finish()
}
