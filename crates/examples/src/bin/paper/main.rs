//! Shows what the project is for: an area in phase space that contracts by exactly the factor of the motion, the paper's figures, and the
//! paper's statements of sections 2 and 3 as checks.
//!
//! ```text
//! cargo run --release --bin paper [-- --out DIR]
//! ```
//!
//! Writes, as CSV and as SVG,
//!
//! - `area`: an area in phase space, carried along by a contact splitting and by the classical Runge-Kutta method;
//! - `free_particle`, `harmonic_oscillator`: the discrete solutions of the paper beside the true motions, with the curves that the paper
//!   calls exact by the formulas that produce them (`*_as_published.csv`);
//! - `conformal_factor`, `angular_momentum`: how these decay, and how the theorems predict it;
//! - `statements.csv`: the residual of each statement on each system by each method.
//!
//! Ends with 1 if an area or a statement fails its check, with 2 if the output cannot be written.

mod area;
mod closed_exact;
mod decay;
mod explicit;
mod figures;
mod published;
mod section2;
mod section3;
mod section5;
mod series;
mod statements;
mod tables;

use area::Area;
use clap::Parser;
use contact_examples::systems::{FreeParticle, HarmonicOscillator};
use contact_examples::{Directory, Failure, finish, number, print};
use discrete_herglotz::rules::Rule;
use published::PublishedRow;
use series::{GAMMA, Row, STEP};
use std::path::PathBuf;
use std::process::ExitCode;

/// Draws an area that contracts with the motion, recomputes the figures of the paper and checks its statements.
#[derive(Parser)]
struct Arguments {
    /// The directory for tables and figures; created where it does not exist.
    #[arg(long, value_name = "DIR", default_value = "out/paper")]
    out: PathBuf,
}

fn main() -> ExitCode {
    finish(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), Failure> {
    let out = Directory::create(&arguments.out)?;

    let area = Area::new()?;
    area.write(&out)?;
    print(&area.report())?;

    let particle = FreeParticle { gamma: GAMMA };
    let rectangle = Rule::RECTANGLE.of::<1, _>(particle, STEP)?;
    let free = series::rows(&particle, &rectangle, 100)?;
    let free_published = published::free_particle(free.len())?;
    let spring = HarmonicOscillator { gamma: GAMMA };
    let oscillator = series::rows(&spring, &Rule::LEFT_MIDPOINT.of::<1, _>(spring, STEP)?, 50)?;
    let oscillator_published = published::harmonic_oscillator(&oscillator)?;
    out.table("free_particle.csv", &series::COLUMNS, free.iter().map(row))?;
    out.table("harmonic_oscillator.csv", &series::COLUMNS, oscillator.iter().map(row))?;
    out.table("free_particle_as_published.csv", &published::COLUMNS, free_published.iter().map(published_row))?;
    out.table(
        "harmonic_oscillator_as_published.csv",
        &published::COLUMNS,
        oscillator_published.iter().map(published_row),
    )?;
    print(&tables::deviations((&free, &free_published), (&oscillator, &oscillator_published)))?;
    print(&tables::rounding(&series::positions_by_flow(&rectangle, free.len())?))?;

    figures::free_particle(&out, &free, &free_published)?;
    figures::harmonic_oscillator(&out, &oscillator)?;
    decay::conformal_factor(&out)?;
    decay::angular_momentum(&out)?;

    let checks = statements::check_all();
    let columns = ["statement", "system", "method", "h", "residual", "tolerance"];
    out.table("statements.csv", &columns, checks.rows())?;
    print(&tables::theorems(&checks))?;
    print(&tables::summary(&area, &checks, out.path()))?;
    area.verdict()?;
    checks.verdict()
}

fn row(row: &Row) -> Vec<String> {
    let entries = [
        row.t,
        row.q,
        row.z,
        row.log_energy_midpoint,
        row.log_hamiltonian,
        row.q_exact,
        row.z_exact,
        row.log_hamiltonian_exact,
    ];
    std::iter::once(row.k.to_string()).chain(entries.map(number)).collect()
}

fn published_row(row: &PublishedRow) -> Vec<String> {
    let entries = [row.t, row.q, row.z, row.log_hamiltonian];
    std::iter::once(row.k.to_string()).chain(entries.map(number)).collect()
}
