//! Adjoint generating functions.

use super::{TypeThree, TypeTwo};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Hessian, PhasePoint, Scalar};

/// The adjoint of a generating function: the function of the other type whose step is the inverse of a step with -h.
///
/// The map of type II from `(t + h, x1)` with the step -h is `q0 = H+_p1(q1, p0, z1)` and so on, where the generating
/// function is evaluated at the end position, the initial momentum and the end action. Its inverse is therefore of type
/// III with `H-_h(t; p0, q1, z1) = -H+_(-h)(t + h; q1, p0, z1)`, that is `S3_h(t) = -S2_(-h)(t + h)`, and conversely.
#[derive(Clone, Copy, Debug)]
pub struct Adjoint<G>(pub G);

impl<G: TypeTwo<N>, const N: usize> TypeThree<N> for Adjoint<G> {
    fn increment<T: Scalar>(&self, t: f64, h: f64, q1: &SVector<T, N>, p0: &SVector<T, N>, z1: T) -> T {
        -self.0.increment(t + h, -h, q1, p0, z1)
    }
    fn with_gradient<T: Scalar>(&self, t: f64, h: f64, x: &PhasePoint<N, T>) -> (T, ChartVector<N, T>) {
        negative(self.0.with_gradient(t + h, -h, x))
    }
    fn second_derivatives(&self, t: f64, h: f64, x: &PhasePoint<N>) -> Hessian<N> {
        scaled(&self.0.second_derivatives(t + h, -h, x), -1.0)
    }
}

impl<G: TypeThree<N>, const N: usize> TypeTwo<N> for Adjoint<G> {
    fn increment<T: Scalar>(&self, t: f64, h: f64, q0: &SVector<T, N>, p1: &SVector<T, N>, z0: T) -> T {
        -self.0.increment(t + h, -h, q0, p1, z0)
    }
    fn with_gradient<T: Scalar>(&self, t: f64, h: f64, x: &PhasePoint<N, T>) -> (T, ChartVector<N, T>) {
        negative(self.0.with_gradient(t + h, -h, x))
    }
    fn second_derivatives(&self, t: f64, h: f64, x: &PhasePoint<N>) -> Hessian<N> {
        scaled(&self.0.second_derivatives(t + h, -h, x), -1.0)
    }
}

fn negative<T: Scalar, const N: usize>((value, d): (T, ChartVector<N, T>)) -> (T, ChartVector<N, T>) {
    (-value, ChartVector { x: -d.x, y: -d.y, z: -d.z })
}

/// The second derivatives of a multiple.
pub(super) fn scaled<const N: usize>(s: &Hessian<N>, a: f64) -> Hessian<N> {
    Hessian { qq: s.qq * a, qv: s.qv * a, vv: s.vv * a, qz: s.qz * a, vz: s.vz * a, zz: s.zz * a }
}
