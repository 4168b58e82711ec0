//! A false claim that derivatives at the time 0 do not show.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// `v^2/2 - q^2/2` with a term whose time derivative vanishes at t = 0, although its claims exclude that term.
#[derive(Debug)]
pub(crate) enum Even {
    Drag,
    Spring,
}

impl Lagrangian<1> for Even {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let oscillator = (v[0] * v[0] - q[0] * q[0]) * 0.5;
        oscillator + t.cos() * if let Even::Drag = self { z * -0.3 } else { q[0] * q[0] * 0.4 }
    }
    fn structure(&self) -> Structure {
        match self {
            Even::Drag => Structure { z_affine: true, constant_rate: true, ..Structure::default() },
            Even::Spring => Structure { quadratic: true, autonomous: true, ..Structure::default() },
        }
    }
}
