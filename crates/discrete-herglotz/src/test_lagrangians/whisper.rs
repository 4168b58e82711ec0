//! A very small force.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// `v.v/2 + c f(t) q0 - b q1^2/2` with `f = 1` or `f = t`: a very small force acts on the first coordinate.
#[derive(Debug)]
pub(crate) struct Whisper {
    pub force: f64,
    pub later: bool,
    pub spring: f64,
}

impl Lagrangian<2> for Whisper {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        let push = q[0] * self.force;
        let push = if self.later { push * t } else { push };
        (v[0] * v[0] + v[1] * v[1]) * 0.5 + push - q[1] * q[1] * (0.5 * self.spring)
    }
    fn structure(&self) -> Structure {
        Structure {
            separable: true,
            z_affine: true,
            constant_rate: true,
            autonomous: !self.later,
            ..Structure::default()
        }
    }
}
