//! A drag that depends on time.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// A pendulum with a time-dependent drag.
#[derive(Debug)]
pub(crate) struct Tides;

impl Lagrangian<1> for Tides {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + q[0].cos() * 2.0 - z * (t.sin() * 0.3 + 0.2)
    }
    fn structure(&self) -> Structure {
        Structure { separable: true, z_affine: true, constant_mass: true, ..Structure::default() }
    }
}
