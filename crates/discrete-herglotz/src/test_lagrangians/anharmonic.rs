//! An anharmonic oscillator, alone or beside coordinates at rest.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// `v.v/2 - x^4/4 + cos x - 0.001 z` with x the first coordinate; no force acts on the others.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anharmonic;

impl<const N: usize> Lagrangian<N> for Anharmonic {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        v.iter().fold(q[0].cos() - q[0].powi(4) * 0.25 - z * 0.001, |l, v| l + *v * *v * 0.5)
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, separable: true, z_affine: true, constant_rate: true, ..Structure::default() }
    }
}
