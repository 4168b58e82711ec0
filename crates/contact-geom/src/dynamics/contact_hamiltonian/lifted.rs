//! Vector fields as contact Hamiltonians.

use crate::support::KernelDual;
use crate::{ChartVector, ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar, vector};
use nalgebra::SVector;

/// A vector field `q' = X(t, q)` on `R^N`, written once as a generic function.
pub trait VectorField<const N: usize> {
    /// The components of the field.
    fn at<T: Scalar>(&self, t: T, q: &SVector<T, N>) -> SVector<T, N>;

    /// Whether the field does not depend on time. The default is false.
    fn is_autonomous(&self) -> bool {
        false
    }
}

/// A vector field as the contact Hamiltonian `H = p . X(t, q)`, linear in the momenta.
///
/// Its motions are `q' = X(t, q)`, the adjoint equation `p' = -X_q^T p`, and `z' = p . H_p - H = 0`: any ordinary
/// differential equation is a contact Hamiltonian system. From `p = 0` the momenta stay 0. From `p = grad g` at the end
/// of a run backward in time, they are the gradient of g in the start. Contact Gauss collocation for H is Gauss
/// collocation for X: it conserves every quadratic first integral, and a quantity whose rate is not negative at the
/// stages does not decrease in a step, since the weights are positive.
///
/// ```
/// use contact_geom::{Lifted, HamiltonianDerivatives, PhasePoint, Scalar, VectorField, nalgebra::SVector};
/// struct Growth;
/// impl VectorField<1> for Growth {
///     #[inline(always)]
///     fn at<T: Scalar>(&self, _t: T, q: &SVector<T, 1>) -> SVector<T, 1> { [q[0] * (-q[0] + 1.0)].into() }
/// }
/// let field = Lifted(Growth).contact_field(0.0, &PhasePoint::new([0.25], [2.0], 0.0));
/// assert_eq!((field.x[0], field.y[0], field.z), (0.1875, -1.0, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lifted<X>(pub X);

impl<const N: usize, X: VectorField<N>> ContactHamiltonian<N> for Lifted<X> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, _z: T) -> T {
        p.dot(&self.0.at(t, q))
    }

    fn structure(&self) -> HamiltonianStructure {
        HamiltonianStructure {
            autonomous: self.0.is_autonomous(),
            z_free: true,
            z_affine: true,
            constant_rate: true,
            separable: false,
            degree: Some(1),
            homogeneous: true,
        }
    }

    /// With derivatives in the positions alone, half as many as those of H.
    #[inline(always)]
    fn closed_with_gradient<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        let mut q: SVector<KernelDual<T, SVector<T, N>>, N> = vector!(|i| KernelDual::constant(x.q[i]));
        for i in 0..N {
            q[i].d[i] = T::one();
        }
        let field = self.0.at(KernelDual::constant(t), &q);
        let mut h = T::zero();
        let mut d = ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: T::zero() };
        for i in 0..N {
            h += x.p[i] * field[i].re;
            d.y[i] = field[i].re;
            for j in 0..N {
                d.x[j] += x.p[i] * field[i].d[j];
            }
        }
        Some((h, d))
    }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl<const N: usize, X: VectorField<N>> crate::ParametricHamiltonian<N> for Lifted<X> {}
