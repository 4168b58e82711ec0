//! Systems of many coordinates: lattices given by the formulas of a site and of a bond, and gravitating bodies.

mod bodies;
mod lattice;
mod run;
mod stepper;
mod sum_of_terms;
mod system;
mod term;

pub use bodies::Bodies;
pub use lattice::{Boundary, Lattice};
pub use run::SiteMotion;
pub use sum_of_terms::SumOfTerms;
pub use system::SiteSystem;
