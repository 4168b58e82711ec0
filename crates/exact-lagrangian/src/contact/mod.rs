//! Exact motions of contact Hamiltonians given directly: the flow, the generating functions of its steps, and the
//! Hamilton-Jacobi equation.

mod error;
mod flow;
mod hamilton_jacobi;
mod left_hamiltonian;
mod panel;
mod right_hamiltonian;
mod shooting;

pub use error::ContactFlowError;
pub use flow::{ContactMotion, contact_flow};
pub use hamilton_jacobi::{FromFunction, FromPoint, HamiltonJacobi, InitialAction, InitialDatum, PrincipalFunction};
pub use left_hamiltonian::ExactLeftHamiltonian;
pub use right_hamiltonian::{ExactRightHamiltonian, GeneratedStep};
