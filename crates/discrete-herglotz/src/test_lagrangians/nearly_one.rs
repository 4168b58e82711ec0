//! An ill-conditioned mass matrix.

use super::Oscillators;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// An oscillator in two nearly dependent coordinates: the mass matrix and the stiffness matrix have condition number
/// 1e10.
#[derive(Debug)]
pub(crate) struct NearlyOne;

impl Lagrangian<2> for NearlyOne {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let turned = |x: &SVector<T, 2>| {
            let (sin, cos) = 0.6f64.sin_cos();
            SVector::from([x[0] * cos + x[1] * sin, (x[1] * cos - x[0] * sin) * 1e-5])
        };
        Oscillators.value(t, &turned(q), &turned(v), z) + turned(q)[1] * turned(q)[1] * 1.5
    }
    fn structure(&self) -> Structure {
        Lagrangian::<2>::structure(&Oscillators)
    }
}
