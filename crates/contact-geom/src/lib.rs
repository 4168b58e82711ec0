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

mod dynamics;
mod error;
mod forms;
mod number;
mod statement;
pub mod statements;
pub mod systems;

pub use dynamics::{
    DarbouxBracket, DarbouxField, Defect, Defects, Derivatives, Energy, HerglotzField, Hessian,
    InfinitesimalConformality, Lagrangian, Legendre, LiftedAction, NoetherMomentum, OneParameterGroup, Quotient,
    Regularity, Structure, Symmetry, TimeTransformation, WithoutClosedDerivatives, check_closed_derivatives,
    conformal_factor_along, derivative_along, derived_gradient, derived_hessian, dissipation_defect, gradient_rounding,
    hamiltonian_vector_field, herglotz_field, herglotz_rates, infinitesimal_conformality, jacobi_bracket, legendre,
    legendre_jacobian, lie_bracket, lie_derivative, regularity,
};
pub use error::GeometryError;
pub use forms::{
    ChartVector, Conformality, ContactForm, Darboux, DiscreteJet, DiscretePoint, EtaMinus, EtaPlus, Form,
    LagrangianForm, PhasePoint, SecondDiscreteJet, Smooth, SmoothFunction, VelocityPoint, conformality,
    conformality_with_jacobian, generic, seed,
};
pub use number::{
    AugmentedVector, Dual, KernelDual, MaxAbsOrNan, MaxOrNan, Scalar, TangentVector, legendre_polynomials, linear,
    max_abs_or_nan, max_or_nan,
};
pub use statement::Statement;

pub use nalgebra;
#[doc(hidden)] // For `scalar_operators`.
pub use num_traits;
