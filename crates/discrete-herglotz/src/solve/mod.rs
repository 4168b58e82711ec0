//! The solution of the equations of a step: Newton's method and linear solvers. Only this module uses faer.

pub(crate) mod chebyshev;
#[cfg(test)]
mod dense_lu_tests;
#[cfg(feature = "faer")]
mod faer_lu;
pub(crate) mod inverse;
#[cfg(any(test, not(feature = "faer")))] // In tests next to faer, to compare them.
mod nalgebra_lu;
pub(crate) mod newton;
pub(crate) mod roots;
pub(crate) mod sign_changes;
pub(crate) mod solver;
pub(crate) mod unknowns;

#[cfg(feature = "faer")]
pub(crate) use faer_lu::DenseLu;
#[cfg(not(feature = "faer"))]
pub(crate) use nalgebra_lu::DenseLu;
pub use newton::{ITERATION_LIMIT, last_correction};
pub use solver::{CROSSOVER, Solver};
