//! A drag that is nonlinear in z.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// A pendulum with a drag of degree two in z, and a constant term in L.
#[derive(Debug)]
pub(crate) struct Curved;

impl Lagrangian<1> for Curved {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.75 + q[0].cos() * (t.cos() * 0.2 + 0.8) + 0.4 - z * 0.2 - z * z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { separable: true, constant_mass: true, ..Structure::default() }
    }
}
