//! A nonlinear drag without forces.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// `v^2/2 - 0.3 z + z^2/5`: without forces the momentum changes only by the conformal factor.
#[derive(Debug)]
pub(crate) struct Free;

impl Lagrangian<1> for Free {
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 - z * 0.3 + z * z * 0.2
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}
