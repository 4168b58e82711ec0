//! What a call costs: the run time from the Lagrangian to the outcome, where an error is requested, beside that of the
//! least expensive given steps that reach it.
//!
//! A call checks its input, selects its steps, makes its tables and integrates; the other tables of the program time the
//! integration alone. The ratio of the two columns of times is the price of the search for the steps.

use crate::library::{Timed, candidates};
use crate::measure::{Effort, sweep, timed};
use crate::problems::Problem;
use crate::row::{Action, Origin, fastest};
use contact_examples::{Directory, Failure, number, print};

/// The errors that are requested.
const ERRORS: [f64; 4] = [1e-3, 1e-6, 1e-9, 1e-12];

/// The columns of the table.
const COLUMNS: [&str; 10] =
    ["problem", "z", "requested", "error", "steps", "evaluations", "seconds", "given_method", "given_seconds", "ratio"];

/// Measures the calls for a problem, and prints their table; returns its rows.
///
/// # Errors
/// Where the Lagrangian as text is invalid.
fn measured(problem: &Problem, z: Action) -> Result<Vec<[String; 10]>, Failure> {
    let calls = candidates(problem, z, Timed::Calls)?;
    let Some((by_accuracy, given)) = calls.split_first() else { return Ok(Vec::new()) };
    let effort = Effort { quick: false };
    let rows: Vec<_> = given.iter().flat_map(|call| sweep(&**call, Origin::Library, problem, z, effort).rows).collect();
    let mut table = Vec::new();
    let mut text = format!("\n{}, {}, z {}: time of a call\n\n", problem.name, problem.title, z.name());
    text += "  requested     error     steps        time   given steps              time    ratio\n";
    for requested in ERRORS {
        let best = fastest(rows.iter(), requested);
        let name = best.map_or(String::new(), |row| format!("{} {}", row.method, row.steps));
        let least = best.map_or(f64::NAN, |row| row.seconds);
        let run = match timed(&**by_accuracy, requested) {
            Ok(run) => run,
            Err(error) => {
                text += &format!("  {requested:<9.0e} {error}\n");
                continue;
            }
        };
        let (error, ratio) = (problem.error(&run.state), run.seconds / least);
        let [own, other] = [run.seconds, least].map(|seconds| seconds * 1e6);
        text += &format!(
            "  {requested:<9.0e} {error:>9.1e} {:>9} {own:>8.1} us   {name:<16} {other:>9.1} us {ratio:>8.2}\n",
            run.steps
        );
        let [requested, error, seconds, least, ratio] = [requested, error, run.seconds, least, ratio].map(number);
        let [steps, evaluations] = [run.steps, run.evaluations].map(|count| count.to_string());
        let (problem, z) = (problem.name.to_owned(), z.name().to_owned());
        table.push([problem, z, requested, error, steps, evaluations, seconds, name, least, ratio]);
    }
    print(&text)?;
    Ok(table)
}

/// Measures the calls for problems, prints a table of each, and writes `calls.csv`.
///
/// # Errors
/// Where a Lagrangian as text is invalid, or the table cannot be written.
pub fn run(problems: impl Iterator<Item = (&'static Problem, Action)>, out: &Directory) -> Result<(), Failure> {
    let mut rows = Vec::new();
    for (problem, z) in problems {
        rows.extend(measured(problem, z)?);
    }
    out.table("calls.csv", &COLUMNS, rows)?;
    print(&format!(
        "\nA ratio is the time of a call for a requested error over that of the least expensive steps that reach it.\n\
         The table is in {}.\n",
        out.path().display()
    ))
}
