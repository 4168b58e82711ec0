//! Coupled pendulums with a mass matrix that is not diagonal.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// Two coupled pendulums with masses that are not diagonal, and drag.
#[derive(Debug)]
pub(crate) struct Coupled;

impl Coupled {
    pub const MASS: [[f64; 2]; 2] = [[2.0, 0.5], [0.5, 1.0]];
    pub const GAMMA: f64 = -0.3;
}

impl Lagrangian<2> for Coupled {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let [[a, b], [_, c]] = Self::MASS;
        let kinetic = v[0] * v[0] * (0.5 * a) + v[0] * v[1] * b + v[1] * v[1] * (0.5 * c);
        kinetic + q[0].cos() + (q[0] - q[1]).cos() * 2.0 + q[1] * t.sin() * 0.1 + z * Self::GAMMA
    }
    fn structure(&self) -> Structure {
        Structure { separable: true, z_affine: true, constant_mass: true, ..Structure::default() }
    }
}
