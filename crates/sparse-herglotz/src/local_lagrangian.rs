//! General local terms of a Lagrangian: the code that a user writes for one element.

use contact_geom::Scalar;
use contact_geom::nalgebra::SVector;

/// A local term `l(t, q, v, z; c)` of a Lagrangian: any function of `K` unknowns, their velocities and the action z of
/// the whole system, with `P` parameters.
///
/// A [`Potential`](crate::Potential) is the special case `l = -V(t, q; c)`, and less expensive. As there, select values
/// with [`Scalar::if_less`] and similar functions, never with `if`, since eight elements are evaluated at once. For a
/// [`FIXED`](crate::FIXED) unknown q and v are 0.
///
/// ```
/// use sparse_herglotz::LocalLagrangian;
/// use contact_geom::{Scalar, nalgebra::SVector};
/// /// A linear finite element of a string of length c: its consistent masses, and its tension.
/// struct StringElement;
/// impl LocalLagrangian<2, 1> for StringElement {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T, c: &[T; 1]) -> T {
///         let stretch = q[1] - q[0];
///         (v[0] * v[0] + v[0] * v[1] + v[1] * v[1]) * c[0] / T::from(6.0) - stretch * stretch / c[0] * 0.5
///     }
/// }
/// assert_eq!(StringElement.value(0.0, &[0.0, 1.0].into(), &[3.0, 3.0].into(), 0.0, &[2.0]), 8.75);
/// ```
pub trait LocalLagrangian<const K: usize, const P: usize = 0>: Send + Sync + 'static {
    /// The value `l(t, q, v, z; c)`.
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, K>, v: &SVector<T, K>, z: T, c: &[T; P]) -> T;
}
