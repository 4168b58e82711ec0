//! Holonomic constraints `c(q) = 0`.

use crate::{Dual, Scalar};
use nalgebra::{SMatrix, SVector};
use num_traits::{One, Zero};

/// `M` holonomic constraints `c(q) = 0` on `N` coordinates, written once as a generic function. They are scleronomic:
/// c does not depend on time.
///
/// The configuration space is `N = { q : c(q) = 0 }`, a manifold of dimension `N - M` where the rows of the Jacobian
/// `G = c_q` are independent. The constrained Herglotz equations are, with multipliers lambda,
/// `d/dt L_v = L_q + L_z L_v + G^T lambda`, `z' = L`, `c(q) = 0`. The force `G^T lambda` does no work and does not
/// enter `z' = L`, so the flow on `T*N x R` is that of the restricted Lagrangian: conformally contact.
///
/// ```
/// use contact_geom::{Scalar, constraints::{Constraint, ConstraintDerivatives}, nalgebra::SVector};
/// struct Circle;
/// impl Constraint<2, 1> for Circle {
///     fn value<T: Scalar>(&self, q: &SVector<T, 2>) -> SVector<T, 1> {
///         SVector::from([q[0] * q[0] + q[1] * q[1] - 1.0])
///     }
/// }
/// let (c, g) = Circle.with_jacobian(&SVector::from([0.6, 0.8]));
/// assert!(c[0].abs() < 1e-15 && g[(0, 1)] == 1.6);
/// ```
pub trait Constraint<const N: usize, const M: usize> {
    /// The values `c(q)`.
    fn value<T: Scalar>(&self, q: &SVector<T, N>) -> SVector<T, M>;

    /// The number of constraints, where it is known at run time only: the first so many values are constraints, and the
    /// others vanish for all positions. It is at most `M`, the default.
    fn count(&self) -> usize {
        M
    }

    /// The derivatives in a parameter, the one with this index among those of the Lagrangian, of the values `c(q)` and of
    /// their Jacobian `c_q`; `None`, the default, where the constraints do not contain it.
    fn in_parameter(&self, _parameter: usize, _q: &SVector<f64, N>) -> Option<(SVector<f64, M>, SMatrix<f64, M, N>)> {
        None
    }
}

impl<const N: usize, const M: usize, C: Constraint<N, M>> Constraint<N, M> for &C {
    fn value<T: Scalar>(&self, q: &SVector<T, N>) -> SVector<T, M> {
        (**self).value(q)
    }

    fn count(&self) -> usize {
        (**self).count()
    }

    fn in_parameter(&self, parameter: usize, q: &SVector<f64, N>) -> Option<(SVector<f64, M>, SMatrix<f64, M, N>)> {
        (**self).in_parameter(parameter, q)
    }
}

/// The derivatives of constraints by dual numbers. The trait is implemented for every [`Constraint`].
pub trait ConstraintDerivatives<const N: usize, const M: usize>: Constraint<N, M> {
    /// The value and the Jacobian `G = c_q`, one row for each constraint.
    fn with_jacobian<T: Scalar>(&self, q: &SVector<T, N>) -> (SVector<T, M>, SMatrix<T, M, N>);

    /// The derivatives of `c` along a velocity, `c_q v` and `c_qq(v, v)`.
    fn along<T: Scalar>(&self, q: &SVector<T, N>, v: &SVector<T, N>) -> [SVector<T, M>; 2];

    /// The Hessian of `lambda . c(q)`, which is the derivative of the constraint force `G^T lambda` in q.
    fn force_slope(&self, q: &SVector<f64, N>, lambda: &SVector<f64, M>) -> SMatrix<f64, N, N>;
}

impl<const N: usize, const M: usize, C: Constraint<N, M> + ?Sized> ConstraintDerivatives<N, M> for C {
    #[inline]
    fn with_jacobian<T: Scalar>(&self, q: &SVector<T, N>) -> (SVector<T, M>, SMatrix<T, M, N>) {
        let mut x = q.map(Dual::<T, SVector<T, N>>::constant);
        for i in 0..N {
            x[i].d[i] = T::one();
        }
        let c = self.value(&x);
        (c.map(|a| a.re), SMatrix::from_fn(|a, i| c[a].d[i]))
    }

    #[inline]
    fn along<T: Scalar>(&self, q: &SVector<T, N>, v: &SVector<T, N>) -> [SVector<T, M>; 2] {
        let x = q.zip_map(v, |re, d| Dual {
            re: Dual { re, d: SVector::<T, 1>::new(d) },
            d: SVector::<Dual<T, SVector<T, 1>>, 1>::new(Dual::constant(d)),
        });
        let c = self.value(&x);
        [c.map(|a| a.d[0].re), c.map(|a| a.d[0].d[0])]
    }

    #[inline]
    fn force_slope(&self, q: &SVector<f64, N>, lambda: &SVector<f64, M>) -> SMatrix<f64, N, N> {
        let mut x = q.map(|re| Dual::<_, SVector<_, N>>::constant(Dual::<f64, SVector<f64, N>>::constant(re)));
        for i in 0..N {
            x[i].re.d[i] = 1.0;
            x[i].d[i] = Dual::one();
        }
        let c = self.value(&x);
        let mut sum = Dual::zero();
        for a in 0..M {
            sum += c[a] * lambda[a];
        }
        SMatrix::from_fn(|i, j| sum.d[i].d[j])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `c = q0^3 q1 + sin q2`.
    struct Surface;
    impl Constraint<3, 1> for Surface {
        fn value<T: Scalar>(&self, q: &SVector<T, 3>) -> SVector<T, 1> {
            SVector::from([q[0].powi(3) * q[1] + q[2].sin()])
        }
    }

    /// Derivatives by dual numbers agree with the closed ones, to a few roundings of terms below 10.
    #[test]
    fn derivatives_of_constraints() {
        let q = SVector::from([1.5, 0.7, 0.4]);
        let v = SVector::from([0.3, -1.1, 0.8]);
        let g = SVector::from([3.0 * q[0] * q[0] * q[1], q[0].powi(3), q[2].cos()]);
        let hessian = SMatrix::<f64, 3, 3>::from_row_slice(&[
            6.0 * q[0] * q[1],
            3.0 * q[0] * q[0],
            0.0,
            3.0 * q[0] * q[0],
            0.0,
            0.0,
            0.0,
            0.0,
            -q[2].sin(),
        ]);
        let tolerance = 32.0 * f64::EPSILON;
        assert!((Surface.with_jacobian(&q).1.transpose() - g).amax() < tolerance);
        let [first, second] = Surface.along(&q, &v);
        assert!((first[0] - g.dot(&v)).abs() < tolerance);
        assert!((second[0] - v.dot(&(hessian * v))).abs() < tolerance);
        assert!((Surface.force_slope(&q, &SVector::from([2.0])) - hessian * 2.0).amax() < tolerance);
    }
}
