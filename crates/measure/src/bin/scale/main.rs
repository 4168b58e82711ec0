//! The library at scale: time and peak memory against size.
//!
//! ```text
//! cargo run --release --bin scale [-- --case NAME|all --quick --out DIR]
//! ```
//!
//! Each case runs sizes that grow by tens and compares its figures with bounds: loops written by hand, a copy of the memory that is
//! touched, other programs, a slope of one. Everything that is compared is measured in the same run.
//!
//! Writes `scale.csv`, a log-log figure of each case, and `verdicts.csv`. Ends with 1 if a figure is above its bound, with 2 if a name
//! is unknown or the output cannot be written.

mod chain;
mod ensembles;
mod lattice;
mod memory;
mod path;
mod peer;
mod report;
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

/// A case: its name, what its sizes count, and what it does.
type Case = (&'static str, &'static str, fn(&mut Report) -> Result<(), Failure>);

const CASES: &[Case] = &[
    ("path", "steps", path::run),
    ("chain", "unknowns", chain::run),
    ("lattice", "unknowns", lattice::run),
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
    let mut report = Report::new(Directory::create(&arguments.out)?, arguments.quick);
    for (name, size, case) in CASES {
        if arguments.case.iter().any(|wanted| wanted == "all" || wanted == name) {
            report.begin(name, size);
            case(&mut report)?;
        }
    }
    report.finish()
}
