//! A uniform field.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// `v^2/2 + 0.3 q`: steps of a splitting are exact up to round-off.
#[derive(Debug)]
pub(crate) struct Fall;

impl Lagrangian<1> for Fall {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 + q[0] * 0.3
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, separable: true, z_free: true, z_affine: true, ..Structure::default() }
    }
}
