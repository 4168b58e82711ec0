//! Implicit integrators: sparse nonlinear equations, solved with faer.

mod border;
mod cholesky;
mod conjugate_gradients;
mod gauss;
mod gauss_table;
mod lu;
mod max_norm;
mod midpoint;
mod midpoint_matrix;
mod newton_convergence;
mod pattern;
mod stage_equations;
mod stage_jacobian;
#[cfg(test)]
mod tests;
mod velocity_solver;

pub(crate) use cholesky::CholeskyFactors;
pub use gauss::SparseGauss;
pub(crate) use lu::LuFactors;
pub(crate) use max_norm::max_norm;
pub use midpoint::SparseMidpoint;
pub(crate) use newton_convergence::{NewtonConvergence, NewtonDecision};
pub(crate) use pattern::{FullPattern, LowerPattern};
