//! Time transformations: the variables in which steps are equal.

use crate::Scalar;
use nalgebra::SVector;

/// A time transformation of an autonomous motion: the time tau with `dt = g(q) dtau`, whose rate g is positive where the motion goes.
///
/// Equal steps of tau are steps of t that follow g. That is the time transformation of Poincare and Levi-Civita: on T\*(Q x R) x R
/// with coordinates `(q, t, p, p_t, z)` the contact Hamiltonian `K = g(q) (H(q, p, z) + p_t)` has on `K = 0` the motion of H
/// in the time tau, and `K' = -K R(K)` with Reeb's field R keeps it there. So a contact method of fixed step for K is one of
/// variable step for H; see Hairer, "Variable time step integration with symplectic methods", Appl. Numer. Math. 25 (1997).
///
/// ```
/// use contact_geom::{nalgebra::SVector, TimeTransformation, Scalar};
/// struct Sundman;
/// impl TimeTransformation<2> for Sundman {
///     fn rate<T: Scalar>(&self, q: &SVector<T, 2>) -> T {
///         q.dot(q).sqrt()
///     }
/// }
/// assert_eq!(Sundman.rate(&SVector::from([3.0, 4.0])), 5.0);
/// ```
pub trait TimeTransformation<const N: usize> {
    /// The rate `g(q) = dt/dtau`.
    fn rate<T: Scalar>(&self, q: &SVector<T, N>) -> T;
}
