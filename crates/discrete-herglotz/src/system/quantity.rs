//! Derivatives with respect to parameters and time.

use crate::{Components, Vector};

/// What a system is differentiated with respect to, at a fixed point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The parameter with this index.
    Parameter(usize),
    /// The time.
    Time,
}

/// The derivatives of L, of its gradient, and of the force with respect to a quantity, at a fixed point: `L_theta`,
/// `(L_qtheta, L_vtheta, L_ztheta)`, `f_theta`.
#[derive(Clone, Debug, PartialEq)]
pub struct ExplicitDerivatives {
    /// That of L.
    pub l: f64,
    /// That of the gradient of L.
    pub gradient: Components,
    /// That of the applied force.
    pub force: Vector,
}

impl ExplicitDerivatives {
    /// No dependence, for n coordinates.
    pub fn zeros(n: usize) -> Self {
        ExplicitDerivatives { l: 0.0, gradient: Components::zeros(n), force: Vector::zeros(n) }
    }

    /// NaN, for n coordinates.
    pub(crate) fn undefined(n: usize) -> Self {
        let none = || Vector::repeat(n, f64::NAN);
        let gradient = Components { x: none(), y: none(), z: f64::NAN };
        ExplicitDerivatives { l: f64::NAN, gradient, force: none() }
    }
}
