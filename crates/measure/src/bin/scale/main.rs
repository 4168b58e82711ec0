//! Times and memory against size.

mod ensembles;
mod report;

fn main() -> Result<(), contact_examples::Failure> {
    ensembles::run(&mut report::Report { quick: std::env::args().any(|a| a == "--quick") })
}
