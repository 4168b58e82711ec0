//! Pieces T(t, p).

use super::ContactPiece;
use crate::hamiltonian::ContactIncrement;
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{ContactHamiltonian, HamiltonianDerivatives, PhasePoint, Scalar};

/// A piece `T(t, p)`, given as a contact Hamiltonian that depends on the momenta alone. The momenta are constant along
/// its flow:
///
/// `q1 = q0 + tau T_p`, `p1 = p0`, `z1 = z0 + tau (p . T_p - T)`, `sigma = 1`.
///
/// ```
/// use contact_geom::{ContactHamiltonian, PhasePoint, Scalar, nalgebra::SVector};
/// use discrete_herglotz::hamiltonian::{ContactPiece, Kinetic};
/// struct Relativistic;
/// impl ContactHamiltonian<1> for Relativistic {
///     fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, p: &SVector<T, 1>, _z: T) -> T { (p[0] * p[0] + 1.0).sqrt() }
/// }
/// let change = Kinetic(Relativistic).change(&2.0, 0.0, &PhasePoint::new([0.0], [0.75], 0.0));
/// assert!((change.q[0] - 1.2).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Kinetic<H>(pub H);

impl<H: ContactHamiltonian<N>, const N: usize> ContactHamiltonian<N> for Kinetic<H> {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        self.0.value(t, q, p, z)
    }
}

impl<H: ContactHamiltonian<N>, const N: usize> ContactPiece<N> for Kinetic<H> {
    type Map = f64;

    fn over(&self, tau: f64) -> f64 {
        tau
    }

    #[inline]
    fn change<T: Scalar>(&self, tau: &f64, t: f64, x: &PhasePoint<N, T>) -> ContactIncrement<N, T> {
        let (h, d) = self.0.with_gradient(T::from(t), x);
        let z = (dot(x.p, d.y) - h) * *tau;
        ContactIncrement { q: d.y.map(|e| e * *tau), z, ..ContactIncrement::zero() }
    }
}
