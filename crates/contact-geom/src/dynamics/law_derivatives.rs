//! The derivatives of a Lagrangian that the laws of impact contain.

use crate::{ChartVector, Derivatives, Dual, Lagrangian, Parametric, Scalar, VelocityPoint};
use nalgebra::{SMatrix, SVector};

/// L with its gradient, and its mass matrix `L_vv`, over one number type.
pub(super) trait LawDerivatives<const N: usize, T> {
    fn value_and_gradient(&self, t: T, x: &VelocityPoint<N, T>) -> (T, ChartVector<N, T>);
    fn mass(&self, t: T, x: &VelocityPoint<N, T>) -> SMatrix<T, N, N>;
}

impl<T: Scalar, L: Lagrangian<N>, const N: usize> LawDerivatives<N, T> for L {
    fn value_and_gradient(&self, t: T, x: &VelocityPoint<N, T>) -> (T, ChartVector<N, T>) {
        self.with_gradient(t, x)
    }
    fn mass(&self, t: T, x: &VelocityPoint<N, T>) -> SMatrix<T, N, N> {
        self.mass_matrix(t, x)
    }
}

/// A Lagrangian at values of its parameters, which are of the number type of the state.
pub(super) struct AtParameters<'a, L, T> {
    pub lagrangian: &'a L,
    pub theta: &'a [T],
}

impl<T: Scalar, L: Parametric<N>, const N: usize> LawDerivatives<N, T> for AtParameters<'_, L, T> {
    fn value_and_gradient(&self, t: T, x: &VelocityPoint<N, T>) -> (T, ChartVector<N, T>) {
        type Along<T, const N: usize> = Dual<T, ChartVector<N, T>>;
        let theta: Vec<_> = self.theta.iter().map(|theta| Along::<T, N>::constant(*theta)).collect();
        let (mut q, mut v) = (x.q.map(Along::<T, N>::constant), x.v.map(Along::<T, N>::constant));
        let mut z = Along::<T, N>::constant(x.z);
        for i in 0..N {
            q[i].d.x[i] = T::one();
            v[i].d.y[i] = T::one();
        }
        z.d.z = T::one();
        let l = self.lagrangian.value_at(&theta, Along::<T, N>::constant(t), &q, &v, z);
        (l.re, l.d)
    }

    fn mass(&self, t: T, x: &VelocityPoint<N, T>) -> SMatrix<T, N, N> {
        type First<T, const N: usize> = Dual<T, SVector<T, N>>;
        type Second<T, const N: usize> = Dual<First<T, N>, SVector<First<T, N>, N>>;
        let still = |x: T| Second::<T, N>::constant(First::<T, N>::constant(x));
        let theta: Vec<_> = self.theta.iter().map(|theta| still(*theta)).collect();
        let (q, mut v) = (x.q.map(still), x.v.map(still));
        for i in 0..N {
            v[i].re.d[i] = T::one();
            v[i].d[i] = First::<T, N>::constant(T::one());
        }
        let l = self.lagrangian.value_at(&theta, still(t), &q, &v, still(x.z));
        SMatrix::from_fn(|i, j| l.d[i].d[j])
    }
}
