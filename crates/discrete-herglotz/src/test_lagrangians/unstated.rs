//! Kinks that are not stated.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// Lagrangians that do not declare their kinks: a spring that is stiffer under compression, and a force that starts at
/// a given time.
#[derive(Debug)]
pub(crate) enum Unstated {
    Stiffer(f64),
    Begins(f64),
}

impl Lagrangian<1> for Unstated {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        let (kinetic, potential) = (v[0] * v[0] * 0.5, q[0] * q[0] * 0.5);
        match self {
            Unstated::Stiffer(k) => kinetic - T::zero().if_less(q[0], potential, potential * *k),
            Unstated::Begins(at) => kinetic - potential + T::from(*at).if_less(t, q[0], T::zero()),
        }
    }

    /// Only the accelerations are iterated, with the number of stages for long runs.
    fn structure(&self) -> Structure {
        let autonomous = matches!(self, Unstated::Stiffer(_));
        let (separable, constant_mass) = (true, true);
        Structure {
            autonomous,
            z_free: true,
            z_affine: true,
            constant_rate: true,
            separable,
            constant_mass,
            ..Structure::default()
        }
    }
}
