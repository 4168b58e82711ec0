//! Parameters of contact Hamiltonians, with respect to which motions can be differentiated.

use crate::numbers::dot;
use crate::{ContactHamiltonian, PhasePoint, Scalar, VelocityPoint};
use crate::{dynamics::contact_hamiltonian::momentum::lift, momentum, support::KernelDual};
use nalgebra::SVector;

/// A contact Hamiltonian with named parameters `theta`; see [`Parametric`](crate::Parametric).
///
/// All methods have defaults for a Hamiltonian without parameters: `impl ParametricHamiltonian<1> for Mine {}`. One with
/// parameters implements all of them. Motions are differentiated from `H_theta` and the derivatives of the gradient,
/// `(H_qtheta, H_ptheta, H_ztheta)`, at known momenta, whatever the rank of `H_pp`.
///
/// ```
/// use contact_geom::{nalgebra::SVector, ContactHamiltonian, ParametricHamiltonian, Scalar};
/// use contact_geom::numbers::{Coefficient, ScalarOver};
/// struct Decay { k: f64 }
/// impl Decay {
///     #[inline(always)]
///     fn formula<C: Coefficient, T: ScalarOver<C>>(k: C, q: T, p: T) -> T { -(p * q.powi(3) * k) }
/// }
/// impl ContactHamiltonian<1> for Decay {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, _z: T) -> T {
///         Self::formula(self.k, q[0], p[0])
///     }
/// }
/// impl ParametricHamiltonian<1> for Decay {
///     fn parameter_names(&self) -> Vec<String> { vec!["k".into()] }
///     fn parameters(&self) -> Vec<f64> { vec![self.k] }
///     fn with_parameters(&self, theta: &[f64]) -> Option<Self> { Some(Decay { k: *theta.first()? }) }
///     #[inline(always)]
///     fn value_at<T: Scalar>(&self, theta: &[T], _t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, _z: T) -> T {
///         Self::formula(theta[0], q[0], p[0])
///     }
/// }
/// assert_eq!(Decay { k: 1.0 }.value_at(&[2.0], 0.0, &[1.0].into(), &[3.0].into(), 0.0), -6.0);
/// ```
pub trait ParametricHamiltonian<const N: usize>: ContactHamiltonian<N> {
    /// The names of the parameters, without repetition; by default there are none.
    fn parameter_names(&self) -> Vec<String> {
        Vec::new()
    }

    /// Their values, in the order of the names.
    fn parameters(&self) -> Vec<f64> {
        Vec::new()
    }

    /// The same Hamiltonian with other values of the parameters; `None` where their number is wrong, and by default.
    fn with_parameters(&self, _theta: &[f64]) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// The value `H(t, q, p, z; theta)`, for as many values as there are names.
    #[inline(always)]
    fn value_at<T: Scalar>(&self, _theta: &[T], t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        self.value(t, q, p, z)
    }
}

/// The Lagrangian `p . v - H(t, q, p, z; theta)` with the momentum of the velocity, for any values of the parameters; NaN
/// where there is no momentum.
pub(super) fn lagrangian_at<H: ParametricHamiltonian<N>, T: Scalar, const N: usize>(
    hamiltonian: &H,
    theta: &[T],
    t: T,
    x: &VelocityPoint<N, T>,
) -> T {
    let values: Vec<f64> = theta.iter().map(|x| x.re()).collect();
    let real = VelocityPoint { q: x.q.map(|e| e.re()), v: x.v.map(|e| e.re()), z: x.z.re() };
    let Some(of_values) = hamiltonian.with_parameters(&values) else { return T::from(f64::NAN) };
    let Ok(p) = momentum(&of_values, t.re(), &real) else { return T::from(f64::NAN) };
    type D<T, const N: usize> = KernelDual<T, SVector<T, N>>;
    let constant = |x: T| D::<T, N>::constant(x);
    let moving: Vec<D<T, N>> = theta.iter().map(|x| constant(*x)).collect();
    // `H_p` over the scalar.
    let velocity = |p: &SVector<T, N>| {
        let mut p = p.map(constant);
        for i in 0..N {
            p[i].d[i] = T::one();
        }
        hamiltonian.value_at(&moving, constant(t), &x.q.map(constant), &p, constant(x.z)).d
    };
    let state = PhasePoint { q: real.q, p, z: real.z };
    match lift(&of_values, t.re(), &state, |p| velocity(p) - x.v) {
        Ok(p) => dot(p, x.v) - hamiltonian.value_at(theta, t, &x.q, &p, x.z),
        Err(_) => T::from(f64::NAN),
    }
}
