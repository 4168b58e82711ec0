//! The theory of discrete Lagrangians on Q x Q x R.

mod discrete_forces;
pub(crate) mod discrete_lagrangian;
mod flow;
mod legendre;
mod legendre_inverse;
mod momentum;
mod path;

pub use discrete_forces::{DiscreteForces, ForceSlopes, discrete_forces};
pub use discrete_lagrangian::{derived_jet, derived_second_jet};
pub use flow::{HamiltonianFlow, discrete_flow, discrete_flow_jacobian, hamiltonian_flow, hamiltonian_flow_jacobian};
pub use legendre::{
    DiscreteRegularity, discrete_regularity, legendre_minus, legendre_minus_inverse, legendre_plus,
    legendre_plus_inverse, sigma_d,
};
pub use legendre_inverse::legendre_inverse;
pub use momentum::{discrete_momentum, discrete_symmetry_defect};
pub use path::{DiscretePath, discrete_action};
