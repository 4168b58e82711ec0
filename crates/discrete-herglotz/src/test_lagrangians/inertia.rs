//! Coupled masses in a potential that depends on time.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// Two different masses with coupled inertia in a time-dependent quartic potential.
#[derive(Debug)]
pub(crate) struct Inertia;

impl Lagrangian<2> for Inertia {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let kinetic = v[0] * v[0] + v[0] * v[1] * 0.6 + v[1] * v[1] * 1.5;
        let (a, b) = (q[0] - q[1] * 0.3, q[1] - t.sin() * 0.2);
        kinetic - a.powi(4) * 0.5 - b * b * 0.7 - q[0] * q[1] * 0.2 - z * 0.15
    }
    fn structure(&self) -> Structure {
        Structure { separable: true, z_affine: true, constant_rate: true, constant_mass: true, ..Structure::default() }
    }
}
