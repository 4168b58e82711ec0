//! A drag that depends on time, with claims to choose.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// `v^2/2 - q^2/2 - sin(t) z/10`, with these claims.
#[derive(Debug)]
pub(crate) struct Rate(pub Structure);

impl Lagrangian<1> for Rate {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 - q[0] * q[0] * 0.5 - z * t.sin() * 0.1
    }
    fn structure(&self) -> Structure {
        self.0
    }
}
