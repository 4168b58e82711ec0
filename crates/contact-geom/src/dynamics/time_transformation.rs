//! Time transformations, by which steps of equal length in a new time vary in length in the physical time.

use crate::Scalar;
use nalgebra::SVector;

/// A time transformation of an autonomous system: a new time tau with `dt = g(q) dtau`, where the rate g is positive
/// along the motion.
///
/// Equal steps in tau are steps in t that are proportional to g. This is the time transformation of Poincaré and
/// Levi-Civita: on T\*(Q x R) x R with coordinates `(q, t, p, p_t, z)` the contact Hamiltonian
/// `K = g(q) (H(q, p, z) + p_t)` has, on the surface `K = 0`, the motion of H in the time tau, and the surface is
/// invariant since `K' = -K R(K)` with the Reeb field R. A contact method of fixed step size for K is therefore a
/// method of variable step size for H; see Hairer, "Variable time step integration with symplectic methods", Appl.
/// Numer. Math. 25 (1997).
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
