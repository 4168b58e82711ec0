//! The exact generating function of type II of quadratic contact Hamiltonians.

use super::TypeTwo;
use crate::hamiltonian::{ContactPiece, Quadratic};
use contact_geom::Scalar;
use contact_geom::nalgebra::{SMatrix, SVector};

/// The exact generating function of type II of a [`Quadratic`] contact Hamiltonian, whose map is its flow. With the
/// blocks of the flow `q1 = E_qq q0 + E_qp p0`, `p1 = E_pq q0 + E_pp p0` and `F = E_pp^-1`
///
/// `H+ = sigma p1 . F^T q0 - sigma q0 . F E_pq q0/2 + p1 . E_qp F p1/2 + (1 - sigma) z0`,
///
/// since then `H+_q0 = sigma F (p1 - E_pq q0) = sigma p0` and `H+_z0 = 1 - sigma`. It exists where `E_pp` is regular.
/// The exact discrete Lagrangian exists where `E_qp` is regular: for the oscillator `p^2/2 + q^2/2` not at h = pi, a
/// conjugate point, where `H+ = -p1 q0`. At h = pi/2 it is the other way round; a singular `E_pp` gives NaN.
///
/// ```
/// use contact_geom::{PhasePoint, nalgebra::SMatrix};
/// use discrete_herglotz::hamiltonian::{ExactTypeTwo, Quadratic, type_two_step};
/// let one = SMatrix::<f64, 1, 1>::identity();
/// let exact = ExactTypeTwo(Quadratic::new(one, one * 0.0, one, 0.0));
/// let x = PhasePoint::new([1.0], [0.5], 0.0);
/// let y = type_two_step(&exact, 0.0, std::f64::consts::PI, &x, &mut 0)?.after(&x);
/// assert!((y.q[0] + 1.0).abs() < 1e-14 && (y.p[0] + 0.5).abs() < 1e-14);
/// # Ok::<(), discrete_herglotz::StepError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ExactTypeTwo<const N: usize>(pub Quadratic<N>);

impl<const N: usize> TypeTwo<N> for ExactTypeTwo<N> {
    fn increment<T: Scalar>(&self, _t: f64, h: f64, q0: &SVector<T, N>, p1: &SVector<T, N>, z0: T) -> T {
        let map = self.0.over(h);
        let one = SMatrix::<f64, N, N>::identity();
        let none = SMatrix::from_element(f64::NAN);
        let f = super::lift::inverse(&(one + map.to_p[1])).unwrap_or(none);
        let sigma = 1.0 + map.growth;
        let form = |m: &SMatrix<f64, N, N>, a: &SVector<T, N>, b: &SVector<T, N>| a.dot(&super::lift::times(m, b));
        // `sigma F^T - 1`, `-sigma F E_pq` and `E_qp F`.
        let mixed = f.transpose() * sigma - one;
        let (qq, pp) = (f * map.to_p[0] * -sigma, map.to_q[1] * f);
        form(&mixed, p1, q0) + (form(&qq, q0, q0) + form(&pp, p1, p1)) * 0.5 - z0 * map.growth
    }
}
