//! Lagrangians and their declared structure, Herglotz and contact Hamiltonian vector fields, symmetries, and time
//! transformations.

mod action;
pub(crate) mod blocks;
mod breaks;
pub(crate) mod constraint;
pub(crate) mod contact_hamiltonian;
mod control;
mod derivatives;
mod force;
mod hamiltonian;
mod herglotz;
mod impact;
mod impact_parameters;
mod lagrangian;
mod lagrangian_enum;
mod lagrangian_form;
mod law_derivatives;
pub(crate) mod nearest_name;
pub(crate) mod parameters;
pub(crate) mod probe;
mod rounding;
mod scalar_system;
mod structure;
mod table;

pub use action::{OneParameterGroup, Symmetry};
pub use breaks::{BreakRate, Breaks};
pub use contact_hamiltonian::{
    AsFunction, AtEnergy, ContactHamiltonian, HamiltonianDerivatives, HamiltonianStructure, InTransformedTime, Lifted,
    NoMomentum, OfHamiltonian, ParametricHamiltonian, TimesRate, VectorField, extended, momentum, split_last,
};
pub use control::Control;
pub use derivatives::{Derivatives, Hessian, derived_gradient, derived_hessian};
pub use force::{Force, ForceStructure, Forced, VelocityDrag};
pub use hamiltonian::{
    DarbouxBracket, DarbouxField, InfinitesimalConformality, Quotient, conformal_factor_along, derivative_along,
    dissipation_defect, hamiltonian_vector_field, infinitesimal_conformality, jacobi_bracket, lie_bracket,
    lie_derivative,
};
pub use herglotz::{
    Energy, HerglotzField, Legendre, LiftedAction, NoetherMomentum, herglotz_field, herglotz_rates, legendre,
    legendre_jacobian, regularity,
};
pub use impact::{Impact, Impacts, Surface};
pub use lagrangian::{Hints, Lagrangian, WithoutClosedDerivatives};
pub use lagrangian_form::LagrangianForm;
pub use parameters::{Parametric, ParametricForce, UnknownParameter, indexed_names};
pub use probe::check_closed_derivatives;
pub use rounding::{gradient_rounding, rounding_at_state};
pub use scalar_system::{Arguments, ScalarSystem, SlicesVisitor, Slopes};
pub use structure::{Defect, Defects, Structure};
pub use table::{Interpolation, Table, TableError};
