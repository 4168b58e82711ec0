//! Contact geometry of mechanical systems with dissipation, pointwise and exact.
//!
//! A system is one function, a Lagrangian `L(t, q, v, z)`; its motion makes the end value of the action critical, where
//! `zdot = L` (Herglotz' principle). This crate computes what the geometry says about it at a point: the contact forms of
//! T\*Q x R, TQ x R and Q x Q x R with their Reeb fields, pullbacks and conformal factors, contact Hamiltonian and Herglotz
//! vector fields, the Legendre transformation, symmetries and their dissipated momenta. It holds no time step, no
//! iteration and no tolerance. [`statements`] checks the theory on any system, [`systems`] is a catalogue to start from.
//!
//! ```
//! use contact_geom::{herglotz_field, nalgebra::SVector, Lagrangian, Scalar, VelocityPoint};
//!
//! struct Pendulum { gamma: f64 }
//! impl Lagrangian<1> for Pendulum {
//!     #[inline(always)]
//!     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
//!         v[0] * v[0] * 0.5 + q[0].cos() + z * self.gamma
//!     }
//! }
//! let x = VelocityPoint::new([1.0], [2.0], 0.0);
//! let xi = herglotz_field(&Pendulum { gamma: -0.1 }, 0.0, &x)?; // (v, a, L)
//! assert!((xi.y[0] - (-1f64.sin() - 0.1 * 2.0)).abs() < 1e-15);
//! # Ok::<(), contact_geom::GeometryError>(())
//! ```
//!
//! Symbols and their names in code are in the project's `NOTATION.md`.

mod action;
mod blocks;
mod clock;
mod contact_form;
mod darboux;
mod discrete_form;
mod dual;
mod error;
mod fibre_form;
mod hamiltonian;
mod herglotz;
mod lagrangian;
mod lagrangian_form;
mod largest;
pub mod linear;
mod module;
#[cfg(feature = "num-dual")]
mod num_dual;
mod points;
mod probe;
mod pullback;
mod rounded;
mod scalar;
mod smooth;
pub mod statements;
mod structure;
pub mod systems;

pub use action::{OneParameterGroup, Symmetry};
pub use clock::Clock;
pub use contact_form::{ContactForm, Form, generic};
pub use darboux::Darboux;
pub use discrete_form::{DiscreteJet, EtaMinus, EtaPlus, SecondDiscreteJet};
pub use dual::{Dual, KernelDual};
pub use error::GeometryError;
pub use hamiltonian::{
    DarbouxBracket, DarbouxField, InfinitesimalConformality, Quotient, conformal_factor_along, derivative_along,
    dissipation_defect, hamiltonian_vector_field, infinitesimal_conformality, jacobi_bracket, lie_bracket,
    lie_derivative,
};
pub use herglotz::{
    Energy, HerglotzField, Legendre, LiftedAction, NoetherMomentum, Regularity, herglotz_field, herglotz_rates,
    legendre, legendre_jacobian, regularity,
};
pub use lagrangian::{Hessian, Lagrangian, ValueOnly, derived_gradient, derived_hessian};
pub use lagrangian_form::LagrangianForm;
pub use largest::{Larger, Largest, larger, largest};
pub use module::{Border, Module};
pub use points::{DiscretePoint, PhasePoint, Triple, VelocityPoint, seed};
pub use probe::check_closed_derivatives;
pub use pullback::{Conformality, conformality, conformality_with_jacobian};
pub use scalar::Scalar;
pub use smooth::{Smooth, SmoothFunction};
pub use structure::{Defect, Defects, Structure};

pub use nalgebra;
