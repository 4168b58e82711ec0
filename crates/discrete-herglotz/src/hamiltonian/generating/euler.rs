//! Contact symplectic Euler.

use super::adjoint::scaled;
use super::{TypeThree, TypeTwo};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, ContactHamiltonian, HamiltonianDerivatives, Hessian, PhasePoint, Scalar};

/// Contact symplectic Euler of a contact Hamiltonian, of order 1: the generating function with the increment `S = h H`.
///
/// Type II, at `(t0; q0, p1, z0)`: `q1 = q0 + h H_p`, `p1 = p0 - h (H_q + p0 H_z)`, `z1 = z0 + h (p1 . H_p - H)`,
/// `sigma = 1 - h H_z`. Type III, at `(t1; q1, p0, z1)`: `q1 = q0 + h H_p`, `p1 = p0 - h (H_q + p1 H_z)`,
/// `z1 = z0 + h (p0 . H_p - H)`, `sigma = 1/(1 + h H_z)`. Each is the adjoint of the other. For `H = T(p) + V(q)` both
/// are explicit maps: a kick and a drift, or a drift and a kick.
#[derive(Clone, Copy, Debug)]
pub struct Euler<H>(pub H);

impl<H: ContactHamiltonian<N>, const N: usize> TypeTwo<N> for Euler<H> {
    fn increment<T: Scalar>(&self, t: f64, h: f64, q0: &SVector<T, N>, p1: &SVector<T, N>, z0: T) -> T {
        self.0.value(T::from(t), q0, p1, z0) * h
    }
    fn with_gradient<T: Scalar>(&self, t: f64, h: f64, x: &PhasePoint<N, T>) -> (T, ChartVector<N, T>) {
        times(self.0.with_gradient(T::from(t), x), h)
    }
    fn second_derivatives(&self, t: f64, h: f64, x: &PhasePoint<N>) -> Hessian<N> {
        scaled(&self.0.hessian(t, x), h)
    }
}

impl<H: ContactHamiltonian<N>, const N: usize> TypeThree<N> for Euler<H> {
    fn increment<T: Scalar>(&self, t: f64, h: f64, q1: &SVector<T, N>, p0: &SVector<T, N>, z1: T) -> T {
        self.0.value(T::from(t + h), q1, p0, z1) * h
    }
    fn with_gradient<T: Scalar>(&self, t: f64, h: f64, x: &PhasePoint<N, T>) -> (T, ChartVector<N, T>) {
        times(self.0.with_gradient(T::from(t + h), x), h)
    }
    fn second_derivatives(&self, t: f64, h: f64, x: &PhasePoint<N>) -> Hessian<N> {
        scaled(&self.0.hessian(t + h, x), h)
    }
}

fn times<T: Scalar, const N: usize>((value, d): (T, ChartVector<N, T>), h: f64) -> (T, ChartVector<N, T>) {
    (value * h, ChartVector { x: d.x.map(|e| e * h), y: d.y.map(|e| e * h), z: d.z * h })
}
