//! A tour of exact discrete Lagrangians: what they look like, where they end, and how their flow meets the motion.
//!
//! ```text
//! cargo run --release --bin exact_tour [-- --out DIR]
//! ```
//!
//! Writes the sections of `L_h^e` beside those of two discretisations (`exact_lagrangian_sections`), a fan of motions with
//! its conjugate points (`conjugate_points`, `conjugate_fan`) and three discrete flows on one exact curve
//! (`exact_and_discrete_flows`), the orders of all methods (`orders`), each as CSV and SVG; and `statements.csv`, the statements of
//! section 4 on every system over six decades of the time step. Ends with 1 if one fails its check, with 2 if the output cannot be
//! written.

mod conjugate;
mod flows;
mod orders;
mod sections;
mod statements;

use clap::Parser;
use contact_examples::{Directory, Failure, finish, print};
use std::path::PathBuf;
use std::process::ExitCode;

/// Computes exact discrete Lagrangians, conjugate points and exact discrete flows, and draws them.
#[derive(Parser)]
struct Arguments {
    /// The directory for tables and figures; created where it does not exist.
    #[arg(long, value_name = "DIR", default_value = "out/exact_tour")]
    out: PathBuf,
}

fn main() -> ExitCode {
    finish(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let out = Directory::create(&arguments.out)?;
    print(&sections::write(&out)?)?;
    print(&conjugate::write(&out)?)?;
    print(&flows::write(&out)?)?;

    let (mut checks, losses) = statements::check();
    statements::write_losses(&out, &losses)?;
    print(&format!("\n{}", statements::tables(&checks)))?;
    print(&statements::loss(&losses))?;
    print(&orders::write(&out, &mut checks)?)?;
    let columns = ["statement", "system", "method", "h", "residual", "tolerance"];
    out.table("statements.csv", &columns, checks.rows())?;
    print(&format!("\nTables and figures are in {}.\n", out.path().display()))?;
    checks.verdict()
}
