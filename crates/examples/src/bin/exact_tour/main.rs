//! A tour of exact discrete Lagrangians: their graphs, the conjugate points that bound their domain, and their flow
//! compared with the motion.
//!
//! ```text
//! cargo run --release --bin exact_tour [-- --out DIR]
//! ```
//!
//! Writes tables and figures into `--out`: sections of `L_h^e` beside those of two discretisations
//! (`exact_lagrangian_sections`), a fan of motions with its conjugate points (`conjugate_points`, and the table
//! `conjugate_fan.csv`), three discrete flows on one exact curve (`exact_and_discrete_flows`), and the orders of all
//! methods (`orders`), as CSV and SVG. Also writes `velocity_loss.csv`, the accuracy of a velocity recovered from two
//! positions, and `statements.csv`, the residuals of the statements of section 4 on every system over six decades of
//! the time step, and the deviations of the orders. The exit code is 1 if a statement fails its check, and 2 if the
//! output cannot be written.

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
