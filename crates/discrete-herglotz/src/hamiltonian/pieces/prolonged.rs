//! Prolonged point transformations: pieces that are affine in the momenta.

use super::ContactPiece;
use crate::hamiltonian::ContactIncrement;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::dot;
use contact_geom::{ContactHamiltonian, Dual, PhasePoint, Scalar, numbers::AugmentedVector, support::linear};

/// The flow of a vector field `q' = X(t, q, z)`, `z' = g(t, q, z)` on Q x R, at each fixed time t.
///
/// [`AffineFlow`](super::AffineFlow), [`PolynomialInAction`](super::PolynomialInAction) and
/// [`ActionPart`](super::ActionPart) have it in closed form. For the lift `p . X(q)` of a vector field on Q, g is 0.
pub trait PointFlow<const N: usize> {
    /// What the flow over a time needs and does not depend on the point.
    type Map: Clone + std::fmt::Debug;

    /// The vector field `(X, g)`.
    fn field<T: Scalar>(&self, t: T, q: &SVector<T, N>, z: T) -> (SVector<T, N>, T);

    /// The map over a time tau of either sign.
    fn over(&self, tau: f64) -> Self::Map;

    /// The increments of q and z; NaN where the flow is not defined so far.
    fn change<T: Scalar>(&self, map: &Self::Map, t: f64, q: &SVector<T, N>, z: T) -> (SVector<T, N>, T);
}

/// The piece `H = p . X(t, q, z) - g(t, q, z)` of a [`PointFlow`]: its flow is the prolongation of the point
/// transformation `(q0, z0) -> (q1, z1)`, by which the momentum, the slope of a graph `z(q)`, is transformed:
///
/// `(D_q q1 + D_z q1 p0^T)^T p1 = D_q z1 + p0 D_z z1`, `sigma = D_z z1 - p1 . D_z q1`.
///
/// This is the unique map over the point transformation with `dz1 - p1 dq1 = sigma (dz0 - p0 dq0)`: both sides are
/// compared in dq0 and in dz0. It covers `f(z)`, `a(q) z`, `p . X(q)` and `z p . X(q)`. Jacobi brackets of such pieces
/// with z-free ones give all contact Hamiltonians that are polynomials in p: Kevrekidis, "Local universal splitting
/// integrators for contact Hamiltonian systems", arXiv 2605.09103.
///
/// ```
/// use contact_geom::{PhasePoint, Scalar, nalgebra::SVector};
/// use discrete_herglotz::hamiltonian::{ContactPiece, PointFlow, Prolonged};
/// /// H = p q^2: q' = q^2.
/// struct Square;
/// impl PointFlow<1> for Square {
///     type Map = f64;
///     fn field<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, _z: T) -> (SVector<T, 1>, T) { ([q[0] * q[0]].into(), T::zero()) }
///     fn over(&self, tau: f64) -> f64 { tau }
///     fn change<T: Scalar>(&self, tau: &f64, _t: f64, q: &SVector<T, 1>, _z: T) -> (SVector<T, 1>, T) {
///         ([q[0] * q[0] * *tau / (-(q[0] * *tau) + 1.0)].into(), T::zero())
///     }
/// }
/// let change = Prolonged(Square).change(&0.5, 0.0, &PhasePoint::new([1.0], [4.0], 0.0));
/// assert_eq!((change.q[0], change.p[0]), (1.0, -3.0)); // p q^2 is conserved
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Prolonged<F>(pub F);

impl<F: PointFlow<N>, const N: usize> ContactHamiltonian<N> for Prolonged<F> {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        let (x, g) = self.0.field(t, q, z);
        dot(p, x) - g
    }
}

impl<F: PointFlow<N>, const N: usize> ContactPiece<N> for Prolonged<F> {
    type Map = F::Map;

    fn over(&self, tau: f64) -> F::Map {
        self.0.over(tau)
    }

    fn change<T: Scalar>(&self, map: &F::Map, t: f64, x: &PhasePoint<N, T>) -> ContactIncrement<N, T> {
        let mut q = x.q.map(Dual::<T, AugmentedVector<N, T>>::constant);
        let mut z = Dual::<T, AugmentedVector<N, T>>::constant(x.z);
        for i in 0..N {
            q[i].d.x[i] = T::one();
        }
        z.d.z = T::one();
        let (dq, dz) = self.0.change(map, t, &q, z);
        // With the increments `d`: `(1 + M)^T (p1 - p0) = D_q dz + p0 D_z dz - M^T p0`, `M = D_q dq + D_z dq p0^T`.
        let m = SMatrix::<T, N, N>::from_fn(|i, j| dq[i].d.x[j] + dq[i].d.z * x.p[j]);
        let mut p = SVector::<T, N>::from_fn(|j, _| {
            (0..N).fold(dz.d.x[j] + x.p[j] * dz.d.z, |sum, i| sum - m[(i, j)] * x.p[i])
        });
        let mut matrix = SMatrix::<T, N, N>::from_fn(|i, j| if i == j { m[(j, i)] + 1.0 } else { m[(j, i)] });
        // At a caustic the image of a graph is vertical.
        if linear::solve(&mut matrix, &mut p).is_err() {
            return ContactIncrement::undefined();
        }
        let sigma_minus_one = (0..N).fold(dz.d.z, |sum, i| sum - (x.p[i] + p[i]) * dq[i].d.z);
        ContactIncrement { q: dq.map(|e| e.re), p, z: dz.re, sigma_minus_one }
    }
}
