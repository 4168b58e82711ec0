//! Affine vector fields on Q x R.

use super::PointFlow;
use crate::hamiltonian::matrix_exponential::exponential_minus_one;
use contact_geom::Scalar;
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};

/// The flow of the affine vector field `q' = A q + a z + b`, `z' = c . q + gamma z + d` by the exponential of its
/// matrix. `Prolonged(AffineFlow { .. })` is the piece `H = p . (A q + a z + b) - c . q - gamma z - d`: the lift of a
/// linear vector field on Q, with drag, and the product `z a . p`. The matrices of a map are computed once for a length
/// of time.
///
/// ```
/// use contact_geom::{PhasePoint, nalgebra::SMatrix};
/// use discrete_herglotz::hamiltonian::{AffineFlow, ContactPiece, Prolonged};
/// // H = p q: positions grow, momenta decay.
/// let lift = Prolonged(AffineFlow { qq: SMatrix::<f64, 1, 1>::identity(), ..AffineFlow::ZERO });
/// let change = lift.change(&lift.over(0.5), 0.0, &PhasePoint::new([1.0], [1.0], 0.0));
/// assert!((change.q[0] - 0.5f64.exp_m1()).abs() < 1e-15 && (change.p[0] - (-0.5f64).exp_m1()).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AffineFlow<const N: usize> {
    /// `A`.
    pub qq: SMatrix<f64, N, N>,
    /// `a`.
    pub qz: SVector<f64, N>,
    /// `b`.
    pub q: SVector<f64, N>,
    /// `c`.
    pub zq: SVector<f64, N>,
    /// `gamma`.
    pub zz: f64,
    /// `d`.
    pub z: f64,
}

impl<const N: usize> AffineFlow<N> {
    /// The field 0.
    pub const ZERO: Self = {
        let zero = SVector::from_array_storage(contact_geom::nalgebra::ArrayStorage([[0.0; N]; 1]));
        let qq = SMatrix::from_array_storage(contact_geom::nalgebra::ArrayStorage([[0.0; N]; N]));
        AffineFlow { qq, qz: zero, q: zero, zq: zero, zz: 0.0, z: 0.0 }
    };

    fn at<T: Scalar>(&self, q: &SVector<T, N>, z: T) -> (SVector<T, N>, T) {
        let x = SVector::from_fn(|i, _| (0..N).fold(z * self.qz[i] + self.q[i], |sum, j| sum + q[j] * self.qq[(i, j)]));
        (x, (0..N).fold(z * self.zz + self.z, |sum, j| sum + q[j] * self.zq[j]))
    }
}

impl<const N: usize> PointFlow<N> for AffineFlow<N> {
    /// The affine map of the increments.
    type Map = AffineFlow<N>;

    fn field<T: Scalar>(&self, _t: T, q: &SVector<T, N>, z: T) -> (SVector<T, N>, T) {
        self.at(q, z)
    }

    fn over(&self, tau: f64) -> AffineFlow<N> {
        // The matrix of the field on (q, z, 1).
        let mut m = DMatrix::zeros(N + 2, N + 2);
        for i in 0..N {
            for j in 0..N {
                m[(i, j)] = self.qq[(i, j)] * tau;
            }
            (m[(i, N)], m[(i, N + 1)], m[(N, i)]) = (self.qz[i] * tau, self.q[i] * tau, self.zq[i] * tau);
        }
        (m[(N, N)], m[(N, N + 1)]) = (self.zz * tau, self.z * tau);
        let e = exponential_minus_one(&m);
        AffineFlow {
            qq: SMatrix::from_fn(|i, j| e[(i, j)]),
            qz: SVector::from_fn(|i, _| e[(i, N)]),
            q: SVector::from_fn(|i, _| e[(i, N + 1)]),
            zq: SVector::from_fn(|i, _| e[(N, i)]),
            zz: e[(N, N)],
            z: e[(N, N + 1)],
        }
    }

    fn change<T: Scalar>(&self, map: &AffineFlow<N>, _t: f64, q: &SVector<T, N>, z: T) -> (SVector<T, N>, T) {
        map.at(q, z)
    }
}
