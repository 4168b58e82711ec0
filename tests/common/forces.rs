//! Forces, and Lagrangians on which they act.

use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{Force, ForceStructure, Lagrangian, Scalar, Structure, VelocityPoint};

/// Gravity.
pub const G: f64 = 9.81;

/// A body in a constant field: `v.v/2 - g q0`.
#[derive(Clone, Copy, Debug)]
pub struct Fall;

impl<const N: usize> Lagrangian<N> for Fall {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>, v: &SVector<T, N>, _z: T) -> T {
        dot(v, v) * 0.5 - q[0] * G
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: true, separable: true, quadratic: true, ..Structure::default() }
    }
}

/// `-c v - k |v| v`.
#[derive(Clone, Copy, Debug)]
pub struct Drag {
    pub c: f64,
    pub k: f64,
}

impl<const N: usize> Force<N> for Drag {
    fn value<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        let speed = dot(x.v, x.v).sqrt();
        x.v.map(|v| -(v * (speed * self.k + self.c)))
    }
    fn structure(&self) -> ForceStructure<N> {
        ForceStructure::Drag { linear: SVector::from_element(self.c), quadratic: self.k }
    }
}

/// The Lagrangian `v^2/2 - g/(2k) (e^(2kq) - 1) + 2 k v z`, whose Herglotz equation is `v' = -g + k v^2`.
#[derive(Clone, Copy, Debug)]
pub struct DragInLagrangian {
    pub k: f64,
}

impl Lagrangian<1> for DragInLagrangian {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let k = self.k;
        v[0] * v[0] * 0.5 - ((q[0] * (2.0 * k)).exp() - 1.0) * (G / (2.0 * k)) + v[0] * z * (2.0 * k)
    }
}

/// A force that is nonlinear in t, q, v and z.
#[derive(Clone, Copy, Debug)]
pub struct AnyForce;

impl<const N: usize> Force<N> for AnyForce {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        SVector::from_fn(|i, _| {
            let (q, v, z) = (x.q[i], x.v[i], x.z);
            (q * 1.3 + t * 0.7).sin() * 0.4 - v * v * v * 0.3 + q * v * 0.25 + (z * 0.5).cos() * v * 0.35
        })
    }
}

/// A force `f(t, q)` that is no gradient.
#[derive(Clone, Copy, Debug)]
pub struct Swirl;

impl<const N: usize> Force<N> for Swirl {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        SVector::from_fn(|i, _| {
            let (here, next) = (x.q[i], x.q[(i + 1) % N]);
            next * 0.4 * if i == 0 { -1.0 } else { 1.0 } + (here * 1.1 + t * 0.6).cos() * 0.3
        })
    }
    fn structure(&self) -> ForceStructure<N> {
        ForceStructure::of_positions()
    }
}

/// A force of the positions that declares nothing.
#[derive(Clone, Copy, Debug)]
pub struct Undeclared<F>(pub F);

impl<const N: usize, F: Force<N>> Force<N> for Undeclared<F> {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        self.0.value(t, x)
    }
}
