//! The solution of a step's equations: Newton's method, and the only place that knows faer.

pub(crate) mod newton;
pub(crate) mod solver;
pub(crate) mod unknowns;

pub use newton::{ITERATION_LIMIT, last_correction};
pub use solver::{CROSSOVER, Solver};
