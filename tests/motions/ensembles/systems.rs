//! The Lagrangians of these tests beside the catalogue.

use crate::lagrangians::{One, one};
use contact_examples::systems::Pendulum;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// A pendulum with a coefficient of the drag.
pub fn pendulum(gamma: f64) -> One {
    one(Pendulum { gamma })
}

/// `v^2/2 + sqrt(1 - q^2) - z/10`: not defined beyond one.
#[derive(Clone, Copy, Debug)]
pub struct Bowl;

impl Lagrangian<1> for Bowl {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + (-(q[0] * q[0]) + 1.0).sqrt() - z * 0.1
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// `v^2/2 - k (q^2/2 + q^4/16) - z/50`: an oscillator whose stiffness is its parameter.
#[derive(Clone, Copy, Debug)]
pub struct Spring {
    pub k: f64,
}

impl Lagrangian<1> for Spring {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let square = q[0] * q[0];
        v[0] * v[0] * 0.5 - (square * 0.5 + square * square * 0.0625) * self.k - z * 0.02
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// An oscillator whose formula branches on the value of its position.
#[derive(Clone, Copy, Debug)]
pub struct Branching;

impl Lagrangian<1> for Branching {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        let stiffness = if q[0].re() < 0.0 { 1.0 } else { 1.5 };
        (v[0] * v[0] - q[0] * q[0] * stiffness) * 0.5
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// The Hénon-Heiles potential with a mass matrix that is not diagonal, and linear drag.
#[derive(Clone, Copy, Debug)]
pub struct HenonHeiles;

impl Lagrangian<2> for HenonHeiles {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let kinetic = (v[0] * v[0] + v[1] * v[1]) * 0.5 + v[0] * v[1] * 0.25;
        let cubic = q[0] * q[0] * q[1] - q[1] * q[1] * q[1] / 3.0;
        kinetic - (q[0] * q[0] + q[1] * q[1]) * 0.5 - cubic - z * 0.02
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}
