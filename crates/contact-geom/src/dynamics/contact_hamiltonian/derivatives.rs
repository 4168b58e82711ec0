//! The derivatives of contact Hamiltonians.

use crate::numbers::dot;
use crate::support::{KernelDual, seed};
use crate::{ChartVector, ContactHamiltonian, Dual, Hessian, PhasePoint, Scalar, vector};
use nalgebra::{SMatrix, SVector};

/// The derivatives of a contact Hamiltonian: in closed form where it provides them, otherwise by automatic
/// differentiation. The trait is implemented for every [`ContactHamiltonian`].
pub trait HamiltonianDerivatives<const N: usize>: ContactHamiltonian<N> {
    /// The value with the partial derivatives `(H_q, H_p, H_z)`, for kernels.
    fn with_gradient<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> (T, ChartVector<N, T>);

    /// The second partial derivatives in `(q, p, z)`, with p in the place of v: `vv` is `H_pp`.
    fn hessian<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> Hessian<N, T>;

    /// The contact Hamiltonian vector field `X_H = (H_p, -H_q - p H_z, p . H_p - H)`; paper, section 2.1.
    #[inline(always)]
    fn contact_field<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> ChartVector<N, T> {
        let (h, d) = self.with_gradient(t, x);
        ChartVector { x: d.y, y: -d.x - x.p * d.z, z: dot(x.p, d.y) - h }
    }
}

impl<H: ContactHamiltonian<N> + ?Sized, const N: usize> HamiltonianDerivatives<N> for H {
    #[inline(always)]
    fn with_gradient<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> (T, ChartVector<N, T>) {
        if let Some(both) = self.closed_with_gradient(t, x) {
            return both;
        }
        if const { Self::PROVED } {
            let none = T::from(f64::NAN);
            let missing = SVector::from_element(none);
            return (none, ChartVector { x: missing, y: missing, z: none });
        }
        type D<T, const N: usize> = KernelDual<T, ChartVector<N, T>>;
        let mut q: SVector<D<T, N>, N> = vector!(|i| KernelDual::constant(x.q[i]));
        let mut p: SVector<D<T, N>, N> = vector!(|i| KernelDual::constant(x.p[i]));
        let mut z = D::<T, N>::constant(x.z);
        for i in 0..N {
            q[i].d.x[i] = T::one();
            p[i].d.y[i] = T::one();
        }
        z.d.z = T::one();
        let h = self.value(KernelDual::constant(t), &q, &p, z);
        (h.re, h.d)
    }

    fn hessian<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> Hessian<N, T> {
        if let Some(hessian) = self.closed_hessian(t, x) {
            return hessian;
        }
        if const { Self::PROVED } {
            let none = T::from(f64::NAN);
            let (matrix, vector) = (SMatrix::from_element(none), SVector::from_element(none));
            return Hessian { qq: matrix, qv: matrix, vv: matrix, qz: vector, vz: vector, zz: none };
        }
        let (_, g) = self.with_gradient(Dual::constant(t), &seed(&ChartVector::from(*x)).into());
        Hessian {
            qq: SMatrix::from_fn(|i, j| g.x[i].d.x[j]),
            qv: SMatrix::from_fn(|i, j| g.x[i].d.y[j]),
            vv: SMatrix::from_fn(|i, j| g.y[i].d.y[j]),
            qz: SVector::from_fn(|i, _| g.x[i].d.z),
            vz: SVector::from_fn(|i, _| g.y[i].d.z),
            zz: g.z.d.z,
        }
    }
}
