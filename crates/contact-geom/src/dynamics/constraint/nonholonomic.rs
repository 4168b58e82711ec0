//! Linear constraints on velocities, `omega(q) v = 0`.

use crate::{Dual, Scalar};
use nalgebra::{SMatrix, SVector};

/// `M` linear constraints on the velocities, `omega(q) v = 0`: the velocity lies in the distribution of planes that the
/// rows of omega annihilate.
///
/// Where the distribution is not integrable the constraints are nonholonomic: they do not restrict the positions. The
/// motion satisfies the Lagrange-d'Alembert-Herglotz equations with multipliers mu,
/// `d/dt L_v = L_q + L_z L_v + omega^T mu`, `z' = L`, `omega(q) v = 0`; paper, section 4. Along it
///
/// - the energy is dissipated, `E' = L_z E` for an autonomous L, since `v . omega^T mu = 0`;
/// - the momentum `p . xi_Q` of a horizontal symmetry, one with `omega xi_Q = 0`, is dissipated, `J' = L_z J`;
/// - the motion is reversible where L is even in v and does not depend on z;
/// - the flow is not conformally contact: `L_X eta - L_z eta = -mu . omega`, which does not vanish.
///
/// ```
/// use contact_geom::{constraints::Distribution, nalgebra::{SMatrix, SVector}, Scalar};
/// /// A blade at (q0, q1) with the direction q2 does not move sideways.
/// struct Blade;
/// impl Distribution<3, 1> for Blade {
///     fn omega<T: Scalar>(&self, q: &SVector<T, 3>) -> SMatrix<T, 1, 3> {
///         let (s, c) = q[2].sin_cos();
///         SMatrix::from_fn(|_, i| [-s, c, T::zero()][i])
///     }
/// }
/// assert_eq!((Blade.omega(&SVector::from([0.0, 0.0, 0.0])) * SVector::from([1.0, 0.0, 5.0]))[0], 0.0);
/// ```
pub trait Distribution<const N: usize, const M: usize> {
    /// The matrix `omega(q)`, one row for each constraint.
    fn omega<T: Scalar>(&self, q: &SVector<T, N>) -> SMatrix<T, M, N>;
}

impl<const N: usize, const M: usize, D: Distribution<N, M>> Distribution<N, M> for &D {
    fn omega<T: Scalar>(&self, q: &SVector<T, N>) -> SMatrix<T, M, N> {
        (**self).omega(q)
    }
}

/// The derivatives of a [`Distribution`] by dual numbers.
pub trait DistributionDerivatives<const N: usize, const M: usize>: Distribution<N, M> {
    /// `omega(q) v` and its derivative in q at a fixed v.
    fn rates(&self, q: &SVector<f64, N>, v: &SVector<f64, N>) -> (SVector<f64, M>, SMatrix<f64, M, N>);
}

impl<const N: usize, const M: usize, D: Distribution<N, M> + ?Sized> DistributionDerivatives<N, M> for D {
    fn rates(&self, q: &SVector<f64, N>, v: &SVector<f64, N>) -> (SVector<f64, M>, SMatrix<f64, M, N>) {
        let mut x = q.map(Dual::<f64, SVector<f64, N>>::constant);
        for i in 0..N {
            x[i].d[i] = 1.0;
        }
        let omega = self.omega(&x);
        let value = SVector::from_fn(|a, _| (0..N).map(|i| omega[(a, i)].re * v[i]).sum());
        let slope = SMatrix::from_fn(|a, j| (0..N).map(|i| omega[(a, i)].d[j] * v[i]).sum());
        (value, slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `omega = (q1^2, sin q0)`.
    struct Turning;
    impl Distribution<2, 1> for Turning {
        fn omega<T: Scalar>(&self, q: &SVector<T, 2>) -> SMatrix<T, 1, 2> {
            SMatrix::from_fn(|_, i| if i == 0 { q[1] * q[1] } else { q[0].sin() })
        }
    }

    /// The derivative of `omega(q) v` agrees with the closed one, to two roundings.
    #[test]
    fn derivatives_of_a_distribution() {
        let (q, v) = (SVector::from([0.4, 1.5]), SVector::from([2.0, -3.0]));
        let (value, slope) = Turning.rates(&q, &v);
        let tolerance = 8.0 * f64::EPSILON;
        assert!((value[0] - (2.0 * 2.25 - 3.0 * q[0].sin())).abs() < tolerance);
        assert!((slope[(0, 0)] + 3.0 * q[0].cos()).abs() < tolerance);
        assert!((slope[(0, 1)] - 2.0 * 2.0 * 1.5).abs() < tolerance);
    }
}
