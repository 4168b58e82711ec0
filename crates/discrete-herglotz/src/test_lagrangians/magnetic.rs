//! A term linear in the velocity.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// `v^2/2 + v - q^2/2`, which is not separable, although it claims to be.
#[derive(Debug)]
pub(crate) struct Magnetic;

impl Lagrangian<1> for Magnetic {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5 + v[0] - q[0] * q[0] * 0.5
    }
    fn structure(&self) -> Structure {
        Structure { z_free: true, separable: true, z_affine: true, ..Structure::default() }
    }
}
