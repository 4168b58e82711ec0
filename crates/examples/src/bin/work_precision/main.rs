//! Work-precision measurements: run time against error, for the library's methods and for other ODE solvers.
//!
//! ```text
//! cargo run --release --bin work_precision [-- --problem NAME --method NAME --z on|off --out DIR] [--peers FILE] [--quick] [--calls]
//! ```
//!
//! Problems with known final states are solved with decreasing steps or tolerances, with the action and without. P1, P2,
//! P3 and P6 are solved by Rust types, P1f, P2f, P3f and P6f by the same Lagrangians as text, which gives the speed of
//! formulas relative to types; P7 and P8 have forces, and are given as text.
//! Each run is repeated (at least seven times, short ones for 20 ms or 200 times), and the median of the times is
//! taken. Only the integration is timed: plans, tables and solvers are made before, for the library and for the peers.
//! Two implementations of dop853 are measured in the same run; rows of peers that are not in Rust are read from the
//! file of `--peers`, which must have been measured on the same machine.
//!
//! With `--calls`, whole calls are timed instead: for a requested error, and with given steps that reach it.
//!
//! Writes `work_precision.csv` and a diagram of each problem into `--out`, and prints the times to reach three errors.
//! Runs without a final state are counted on stderr. The exit code is 2 if a name is unknown, the file of the peers is
//! invalid, or the output cannot be written.

mod calls;
mod candidate;
mod diagrams;
mod library;
mod measure;
mod peers;
mod problems;
mod recorded;
mod row;
mod summary;

use candidate::Candidate;
use clap::Parser;
use contact_examples::{Directory, Failure, check_names, finish, is_requested, print, progress_bar};
use measure::{Effort, sweep};
use problems::{PROBLEMS, Problem};
use recorded::Peers;
use row::{Action, Origin, Row};
use std::path::PathBuf;
use std::process::ExitCode;

/// Measures the run time for an error, with the library's methods and with others.
#[derive(Parser)]
struct Arguments {
    /// The problems, separated by commas.
    #[arg(long, value_name = "NAME", value_delimiter = ',', default_value = "all")]
    problem: Vec<String>,
    /// The methods, separated by commas; `all` for each that applies, `chosen` for one or two of each kind and the
    /// peers.
    #[arg(long, value_name = "NAME", value_delimiter = ',', default_value = "chosen")]
    method: Vec<String>,
    /// With or without the action; both by default.
    #[arg(long)]
    z: Option<Action>,
    /// The directory for table and diagrams; created where it does not exist.
    #[arg(long, value_name = "DIR", default_value = "out/work_precision")]
    out: PathBuf,
    /// Rows of peers measured elsewhere, of which those of heyoka are used.
    #[arg(long, value_name = "FILE")]
    peers: Option<PathBuf>,
    /// Uses the rows of all peers in that file.
    #[arg(long, requires = "peers")]
    all_peers: bool,
    /// Measures a third of the steps, and ends each sweep at a shorter run time.
    #[arg(long)]
    quick: bool,
    /// Measures whole calls for a requested error instead, beside calls with given steps; writes `calls.csv`.
    #[arg(long, conflicts_with_all = ["peers", "quick", "method"])]
    calls: bool,
}

/// A candidate, with the problem that it solves and its origin.
struct Entry {
    problem: &'static Problem,
    z: Action,
    origin: Origin,
    candidate: Box<dyn Candidate>,
}

fn main() -> ExitCode {
    finish(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let all = entries()?;
    let mut methods: Vec<&str> = all.iter().map(|entry| entry.candidate.name()).chain(["chosen"]).collect();
    methods.sort_unstable();
    methods.dedup();
    check_names("problem", &arguments.problem, &PROBLEMS.map(|problem| problem.name))?;
    check_names("method", &arguments.method, &methods)?;
    let is_measured = |problem: &Problem, z: Action| {
        let with = arguments.z.is_none_or(|requested| requested == z);
        with && is_requested(&arguments.problem, problem.name)
    };
    if arguments.calls {
        let problems = variants().filter(|(problem, z)| is_measured(problem, *z));
        return calls::run(problems, &Directory::create(&arguments.out)?);
    }

    let mut rows = match &arguments.peers {
        Some(path) => recorded::read(path, if arguments.all_peers { Peers::All } else { Peers::Heyoka })?,
        None => Vec::new(),
    };
    rows.retain(|row| PROBLEMS.iter().any(|problem| problem.name == row.problem && is_measured(problem, row.z)));
    let out = Directory::create(&arguments.out)?;
    let chosen: Vec<Entry> = all
        .into_iter()
        .filter(|entry| {
            let shown = matches!(entry.origin, Origin::Peer) || library::DIAGRAMS.contains(&entry.candidate.name());
            let chosen = shown && arguments.method.iter().any(|name| name == "chosen");
            is_measured(entry.problem, entry.z) && (chosen || is_requested(&arguments.method, entry.candidate.name()))
        })
        .collect();
    rows.extend(measure(&chosen, Effort { quick: arguments.quick }));
    row::sort(&mut rows);

    out.table("work_precision.csv", &row::COLUMNS, rows.iter().map(Row::fields))?;
    for (problem, z) in variants().filter(|(problem, z)| is_measured(problem, *z)) {
        diagrams::write(&out, problem, z, &rows)?;
        print(&summary::of(problem, z, &rows))?;
    }
    print(&format!(
        "\nA ratio is the time of the peer over that of the library: above 1, the library is faster.\n\
         Table and diagrams are in {}.\n",
        out.path().display()
    ))
}

/// The problems without the action, where they can be solved without it, and with the action.
fn variants() -> impl Iterator<Item = (&'static Problem, Action)> {
    let both = PROBLEMS.iter().flat_map(|problem| Action::ALL.map(|z| (problem, z)));
    both.filter(|(problem, z)| *z == Action::On || !problem.needs_z())
}

/// All candidates.
fn entries() -> Result<Vec<Entry>, Failure> {
    let mut all = Vec::new();
    for (problem, z) in variants() {
        let entry = |origin| move |candidate| Entry { problem, z, origin, candidate };
        all.extend(library::candidates(problem, z, library::Timed::Steps)?.into_iter().map(entry(Origin::Library)));
        all.extend(peers::candidates(problem, z).into_iter().map(entry(Origin::Peer)));
    }
    Ok(all)
}

/// Measures all entries, with a progress bar.
fn measure(entries: &[Entry], effort: Effort) -> Vec<Row> {
    let bar = progress_bar("measuring", entries.len(), "  {msg}");
    let mut rows = Vec::new();
    for Entry { problem, z, origin, candidate } in entries {
        let subject = format!("{}, z {}, {}", problem.name, z.name(), candidate.name());
        bar.set_message(subject.clone());
        let found = sweep(candidate.as_ref(), *origin, problem, *z, effort);
        rows.extend(found.rows);
        if let Some((control, cause)) = found.failed.first() {
            let count = found.failed.len();
            bar.suspend(|| eprintln!("note: {subject}: {count} runs without a final state; with {control:e}: {cause}"));
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    rows
}
