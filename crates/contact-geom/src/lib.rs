//! Contact geometry of mechanical systems with dissipation, evaluated at points to round-off.
//!
//! A system is given by one function, its Lagrangian `L(t, q, v, z)`; its motion makes the final value of the action z
//! critical, where `zdot = L` (Herglotz' principle). This crate evaluates the geometry at a point: the contact forms of
//! T\*Q x R, TQ x R and Q x Q x R with their Reeb fields, pullbacks and conformal factors, contact Hamiltonian and
//! Herglotz vector fields, the Legendre transformation, symmetries and their dissipated momenta. It contains no time
//! steps, iterations or tolerances. [`statements`] checks the theory on any system.
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
//! The project's `NOTATION.md` lists the symbols with their names in code.

mod dynamics;
mod error;
mod forms;
pub mod groups;
mod number;
mod statement;
pub mod statements;

/// Contact Hamiltonian vector fields and their algebra: brackets, Lie derivatives, infinitesimal conformality.
pub mod hamiltonian {
    pub use crate::dynamics::{
        DarbouxBracket, DarbouxField, InfinitesimalConformality, conformal_factor_along, derivative_along,
        dissipation_defect, hamiltonian_vector_field, infinitesimal_conformality, jacobi_bracket, lie_bracket,
        lie_derivative,
    };
}

/// Constraints: holonomic `c(q) = 0`, and linear in the velocities, `omega(q) v = 0`.
pub mod constraints {
    pub use crate::dynamics::constraint::{
        ConstrainedMotion, Constraint, ConstraintDerivatives, Distribution, DistributionDerivatives, Redundancy,
        constrained_motion, nonholonomic_motion,
    };
}

/// Vector spaces of dual parts, vectors from functions of the index, and maxima that propagate NaN.
pub mod numbers {
    pub use crate::number::{
        AugmentedVector, Coefficient, MaxAbsOrNan, MaxOrNan, ScalarOver, TangentVector, dot, max_abs_or_nan,
        max_or_nan, vector_of,
    };
}

/// Tools for the other crates of this project: derivatives by dual numbers, seeds, small linear systems, rounding.
pub mod support {
    pub use crate::dynamics::constraint::{independent_rows, least_norm, restricted};
    pub use crate::dynamics::nearest_name::nearest_name;
    pub use crate::dynamics::{
        derived_gradient, derived_hessian, extended, gradient_rounding, herglotz_rates, indexed_names,
        rounding_at_state, split_last,
    };
    pub use crate::forms::{conformality_with_jacobian, generic, seed};
    pub use crate::number::{KernelDual, legendre_polynomials, linear};
}

/// Functions of time by samples.
pub mod table {
    pub use crate::dynamics::{Interpolation, Table, TableError};
}

/// Surfaces at which a motion is interrupted: impacts, resets, and the times of kinks and jumps.
pub mod switching {
    pub use crate::dynamics::{BreakRate, Breaks, Control, Impact, Impacts, Surface};
}

pub use dynamics::{
    Arguments, AsFunction, AtEnergy, ContactHamiltonian, Defect, Defects, Derivatives, Energy, Force, ForceStructure,
    Forced, HamiltonianDerivatives, HamiltonianStructure, HerglotzField, Hessian, Hints, InTransformedTime, Lagrangian,
    LagrangianForm, Legendre, Lifted, LiftedAction, NoMomentum, NoetherMomentum, OfHamiltonian, OneParameterGroup,
    Parametric, ParametricForce, ParametricHamiltonian, Quotient, ScalarSystem, SlicesVisitor, Slopes, Structure,
    Symmetry, TimesRate, UnknownParameter, VectorField, VelocityDrag, WithoutClosedDerivatives,
    check_closed_derivatives, herglotz_field, legendre, legendre_jacobian, momentum, regularity,
};
pub use error::GeometryError;
pub use forms::{
    ChartVector, Conformality, ContactForm, Darboux, DiscreteJet, DiscretePoint, EtaMinus, EtaPlus, Form,
    LegendrianDefect, OnParameters, PhasePoint, SecondDiscreteJet, Smooth, SmoothFunction, VelocityPoint, conformality,
    legendrian_defect,
};
pub use number::{Dual, Regularity, Scalar};
pub use statement::Statement;

pub use nalgebra;
#[doc(hidden)] // For `scalar_operators`.
pub use num_traits;
