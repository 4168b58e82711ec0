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

pub use gauss::SparseGauss;
pub use midpoint::SparseMidpoint;
pub(crate) use pattern::{FullPattern, LowerPattern};
