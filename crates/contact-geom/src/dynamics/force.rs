//! Forces that no Lagrangian contains.

use crate::{ChartVector, Hessian, Hints, Lagrangian, Scalar, Structure, VelocityPoint};
use nalgebra::{SMatrix, SVector};

/// A force on a motion, in the Lagrange-d'Alembert-Herglotz equations
///
/// `d/dt L_v - L_q - L_z L_v = f(t, q, v, z)`, `zdot = L`.
///
/// They follow from the principle `rho(T) dz(T) + int rho f . dq dt = 0` for variations with fixed ends, where
/// `rho = exp(-int L_z)`. The force does no work in `zdot = L`; the energy `E = v . L_v - L` changes as
/// `Edot = L_z E - L_t + f . v`. Written once as a generic function, like a [`Lagrangian`].
///
/// ```
/// use contact_geom::{nalgebra::SVector, Force, Scalar, VelocityPoint};
/// /// `-c |v| v`.
/// struct QuadraticDrag { c: f64 }
/// impl<const N: usize> Force<N> for QuadraticDrag {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
///         let speed = x.v.dot(&x.v).sqrt();
///         x.v.map(|v| -(v * speed * self.c))
///     }
/// }
/// let drag = QuadraticDrag { c: 0.5 };
/// assert_eq!(drag.value(0.0, &VelocityPoint::new([0.0, 0.0], [3.0, 4.0], 0.0)), SVector::from([-7.5, -10.0]));
/// ```
///
/// Annotate `value` with `#[inline(always)]`, as that of a Lagrangian.
pub trait Force<const N: usize> {
    /// The force `f(t, q, v, z)`.
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N>;
}

impl<const N: usize, F: Force<N>> Force<N> for &F {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        (**self).value(t, x)
    }
}

/// A Lagrangian with a [`Force`]. Its derivatives are those of the Lagrangian; [`herglotz_field`](crate::herglotz_field)
/// contains the force. Integrators that do not take forces refuse it.
///
/// The flow is not conformally contact: its defect is the virtual work of the force.
#[derive(Clone, Copy, Debug)]
pub struct Forced<L, F> {
    /// The Lagrangian.
    pub lagrangian: L,
    /// The force.
    pub force: F,
}

impl<const N: usize, L: Lagrangian<N>, F: Force<N>> Lagrangian<N> for Forced<L, F> {
    const HINTS: Hints = Hints { forced: true, ..L::HINTS };

    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.lagrangian.value(t, q, v, z)
    }
    #[inline(always)]
    fn applied_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        self.force.value(t, x)
    }
    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<ChartVector<N, T>> {
        self.lagrangian.closed_gradient(t, x)
    }
    #[inline(always)]
    fn closed_hessian<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<Hessian<N, T>> {
        self.lagrangian.closed_hessian(t, x)
    }
    #[inline(always)]
    fn closed_with_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        self.lagrangian.closed_with_gradient(t, x)
    }
    #[inline(always)]
    fn closed_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<SVector<T, N>> {
        self.lagrangian.closed_force(t, x)
    }
    #[inline(always)]
    fn closed_with_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<(T, SVector<T, N>)> {
        self.lagrangian.closed_with_force(t, x)
    }
    #[inline(always)]
    fn closed_rate<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<T> {
        self.lagrangian.closed_rate(t, x)
    }
    #[inline(always)]
    fn closed_mass_matrix<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<SMatrix<T, N, N>> {
        self.lagrangian.closed_mass_matrix(t, x)
    }
    /// Of the structure of the Lagrangian, what a force leaves: the drag and the mass matrix. The motion may depend on time
    /// and on z, and is neither separable nor linear.
    fn structure(&self) -> Structure {
        let of_lagrangian = self.lagrangian.structure();
        let constant_mass = of_lagrangian.constant_mass || of_lagrangian.separable || of_lagrangian.quadratic;
        Structure {
            autonomous: false,
            z_free: false,
            separable: false,
            quadratic: false,
            constant_mass,
            constant_rate: of_lagrangian.has_constant_rate(),
            z_affine: of_lagrangian.is_affine_in_z(),
        }
    }
    fn switching_functions(&self, t: f64, x: &VelocityPoint<N>, values: &mut Vec<f64>) {
        self.lagrangian.switching_functions(t, x, values);
    }
    #[inline(always)]
    fn dt_dtau<T: Scalar>(&self, q: &SVector<T, N>) -> T {
        self.lagrangian.dt_dtau(q)
    }
}
