//! Linear motions.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// Oscillators with drag, of frequencies 1, 2 .. N: `v.v/2 - (k x_k)^2/2 - z/10`.
#[derive(Debug)]
pub(crate) struct Oscillators;

impl<const N: usize> Lagrangian<N> for Oscillators {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        (0..N).fold(-z * 0.1, |l, k| l + (v[k] * v[k] - q[k] * q[k] * ((k + 1) as f64).powi(2)) * 0.5)
    }
    fn structure(&self) -> Structure {
        Structure {
            autonomous: true,
            separable: true,
            quadratic: true,
            z_affine: true,
            constant_rate: true,
            constant_mass: true,
            ..Structure::default()
        }
    }
}
