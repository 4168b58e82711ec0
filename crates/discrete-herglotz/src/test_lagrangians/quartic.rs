//! A potential without a lower bound.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// `v^2/2 + q^4 - z/10`: motions leave every bound in a finite time.
#[derive(Debug)]
pub(crate) struct Quartic;

impl Lagrangian<1> for Quartic {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + q[0].powi(4) - z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, separable: true, z_affine: true, ..Structure::default() }
    }
}
