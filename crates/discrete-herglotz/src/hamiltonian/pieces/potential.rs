//! Pieces V(t, q).

use super::ContactPiece;
use crate::hamiltonian::ContactIncrement;
use contact_geom::nalgebra::SVector;
use contact_geom::{ContactHamiltonian, HamiltonianDerivatives, PhasePoint, Scalar};

/// A piece `V(t, q)`, given as a contact Hamiltonian that depends on the positions alone. The positions are constant
/// along its flow:
///
/// `q1 = q0`, `p1 = p0 - tau V_q`, `z1 = z0 - tau V`, `sigma = 1`.
///
/// ```
/// use contact_geom::{ContactHamiltonian, PhasePoint, Scalar, nalgebra::SVector};
/// use discrete_herglotz::hamiltonian::{ContactPiece, Potential};
/// struct Quartic;
/// impl ContactHamiltonian<1> for Quartic {
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, _p: &SVector<T, 1>, _z: T) -> T { q[0].powi(4) * 0.25 }
/// }
/// let change = Potential(Quartic).change(&0.1, 0.0, &PhasePoint::new([2.0], [0.0], 0.0));
/// assert!((change.p[0] + 0.8).abs() < 1e-15 && (change.z + 0.4).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Potential<H>(pub H);

impl<H: ContactHamiltonian<N>, const N: usize> ContactHamiltonian<N> for Potential<H> {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        self.0.value(t, q, p, z)
    }
}

impl<H: ContactHamiltonian<N>, const N: usize> ContactPiece<N> for Potential<H> {
    type Map = f64;

    fn over(&self, tau: f64) -> f64 {
        tau
    }

    #[inline]
    fn change<T: Scalar>(&self, tau: &f64, t: f64, x: &PhasePoint<N, T>) -> ContactIncrement<N, T> {
        let (h, d) = self.0.with_gradient(T::from(t), x);
        ContactIncrement { p: d.x.map(|e| e * -*tau), z: h * -*tau, ..ContactIncrement::zero() }
    }
}
