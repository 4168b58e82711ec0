//! Contact Hamiltonians H(t, q, p, z) that are given directly.

use crate::{ChartVector, Hessian, PhasePoint, Scalar, SmoothFunction};
use nalgebra::SVector;

mod at_energy;
mod derivatives;
mod in_transformed_time;
mod lifted;
mod momentum;
mod of_hamiltonian;
mod parametric;
mod structure;

pub use at_energy::AtEnergy;
pub use derivatives::HamiltonianDerivatives;
pub use in_transformed_time::{InTransformedTime, TimesRate, extended, split_last};
pub use lifted::{Lifted, VectorField};
pub use momentum::{NoMomentum, momentum};
pub use of_hamiltonian::OfHamiltonian;
pub use parametric::ParametricHamiltonian;
pub use structure::HamiltonianStructure;

/// A contact Hamiltonian `H : R x T*Q x R -> R`, written once as a generic function of (t, q, p, z).
///
/// Its motions are the integral curves of the contact Hamiltonian vector field `X_H` of `eta = dz - p dq`,
/// `q' = H_p`, `p' = -H_q - p H_z`, `z' = p . H_p - H`; paper, section 2.1. With the usual sign convention a dissipative
/// term is `-gamma z` with `gamma < 0`. `H_pp` may have any rank: H may be linear in the momenta, as for optimal control
/// and thermodynamics, or homogeneous of degree one in them, as for rays of light. Where `H_pp` is regular there is a
/// Lagrangian with the same motions, and [`OfHamiltonian`] evaluates it.
///
/// An implementation needs [`value`](Self::value); all derivatives are obtained by evaluating it on dual numbers.
/// Annotate it, and the functions that it calls, with `#[inline(always)]`, as for a [`Lagrangian`](crate::Lagrangian).
///
/// ```
/// use contact_geom::{nalgebra::SVector, ContactHamiltonian, HamiltonianDerivatives, PhasePoint, Scalar};
/// /// Van der Pol's oscillator: H is linear in p.
/// struct VanDerPol;
/// impl ContactHamiltonian<1> for VanDerPol {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
///         p[0] * z + q[0] + (q[0] * q[0] - 1.0) * z
///     }
/// }
/// let (_, d) = VanDerPol.with_gradient(0.0, &PhasePoint::new([2.0], [0.0], 0.5));
/// assert_eq!((d.x[0], d.y[0], d.z), (3.0, 0.5, 3.0)); // (H_q, H_p, H_z)
/// ```
pub trait ContactHamiltonian<const N: usize> {
    /// Whether the [structure](Self::structure) and all closed derivatives are derived from the formula of H, as by the
    /// crate `formula-lagrangian`. They are then not checked numerically, and automatic differentiation is not compiled.
    const PROVED: bool = false;
    /// Whether an evaluation has a large fixed cost, so that batches of evaluations are preferred.
    const INTERPRETED: bool = false;
    /// Whether it has [switching functions](Self::switching_functions) or [breaks](Self::breaks).
    const SWITCHING: bool = false;

    /// The value `H(t, q, p, z)`.
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T;

    /// The declared structure; see [`HamiltonianStructure`]. The default makes no claims.
    fn structure(&self) -> HamiltonianStructure {
        HamiltonianStructure::default()
    }

    /// The value with the partial derivatives `(H_q, H_p, H_z)` in closed form; `None`, the default, where a closed form
    /// is not provided.
    #[inline(always)]
    fn closed_with_gradient<T: Scalar>(&self, _t: T, _x: &PhasePoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        None
    }

    /// The second partial derivatives in closed form, with p in the place of v: `vv` is `H_pp`. `None`, the default,
    /// where a closed form is not provided.
    fn closed_hessian<T: Scalar>(&self, _t: T, _x: &PhasePoint<N, T>) -> Option<Hessian<N, T>> {
        None
    }

    /// The switching functions `g_i(t, q, p, z)`, at whose zeros H has a kink or a jump: appends their values at a state,
    /// always in the same number and order. A run ends a step at each zero that its motion crosses, so that integrators
    /// keep their order. There q, p and z are continuous, unless H itself jumps across a surface in the positions: then
    /// the momentum changes along the normal so that H does not change, or the motion is reflected, as in
    /// [`Lagrangian::switching_functions`](crate::Lagrangian::switching_functions). By default there are none: H is
    /// smooth.
    ///
    /// Set [`SWITCHING`](Self::SWITCHING) as well. For example, `H = p_x v - |p_v|`, a time-optimal control, has the
    /// single switching function `p_v`.
    fn switching_functions(&self, _t: f64, _x: &PhasePoint<N>, _values: &mut Vec<f64>) {}

    /// The times at which H has a kink or a jump in time, in ascending order: steps end there. Set
    /// [`SWITCHING`](Self::SWITCHING) as well. By default there are none.
    fn breaks(&self) -> &[f64] {
        &[]
    }
}

impl<const N: usize, H: ContactHamiltonian<N>> ContactHamiltonian<N> for &H {
    const PROVED: bool = H::PROVED;
    const INTERPRETED: bool = H::INTERPRETED;
    const SWITCHING: bool = H::SWITCHING;

    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        (**self).value(t, q, p, z)
    }
    fn structure(&self) -> HamiltonianStructure {
        (**self).structure()
    }
    #[inline(always)]
    fn closed_with_gradient<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> Option<(T, ChartVector<N, T>)> {
        (**self).closed_with_gradient(t, x)
    }
    fn closed_hessian<T: Scalar>(&self, t: T, x: &PhasePoint<N, T>) -> Option<Hessian<N, T>> {
        (**self).closed_hessian(t, x)
    }
    fn switching_functions(&self, t: f64, x: &PhasePoint<N>, values: &mut Vec<f64>) {
        (**self).switching_functions(t, x, values);
    }
    fn breaks(&self) -> &[f64] {
        (**self).breaks()
    }
}

/// A contact Hamiltonian as a [`SmoothFunction`] on T\*Q x R, for vector fields, brackets and Lie derivatives.
///
/// ```
/// use contact_geom::{AsFunction, ChartVector, Darboux, Smooth, hamiltonian::DarbouxField};
/// # use contact_geom::{nalgebra::SVector, ContactHamiltonian, Scalar};
/// # struct Ray;
/// # impl ContactHamiltonian<1> for Ray {
/// #     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, _z: T) -> T { p[0] * (q[0] + 1.0) }
/// # }
/// let field = DarbouxField { hamiltonian: &AsFunction(&Ray), t: 0.0 };
/// let x = field.at(&ChartVector { x: [1.0].into(), y: [3.0].into(), z: 0.0 })?;
/// assert_eq!((x.x[0], x.y[0], x.z), (2.0, -3.0, 0.0));
/// # Ok::<(), contact_geom::GeometryError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct AsFunction<'a, H>(pub &'a H);

impl<const N: usize, H: ContactHamiltonian<N>> SmoothFunction<N> for AsFunction<'_, H> {
    fn value<T: Scalar>(&self, t: T, x: &ChartVector<N, T>) -> T {
        self.0.value(t, &x.x, &x.y, x.z)
    }
}
