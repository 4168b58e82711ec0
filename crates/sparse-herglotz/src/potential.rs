//! Local potential energies: the code that a user writes for one element.

use contact_geom::nalgebra::{ArrayStorage, SVector};
use contact_geom::{Scalar, support::KernelDual};

/// A local potential energy `V(t, q; c)` of `K` unknowns with `P` parameters: that of a site, a bond or a finite
/// element.
///
/// It enters the Lagrangian as `-V`. The function is written once for any number of elements; each element has its own
/// unknowns and parameters `c`. Annotate it with `#[inline(always)]`: elements are evaluated eight at a time in the
/// lanes of vector registers, and a function that is not inlined into those loops is slow. Select values with
/// [`Scalar::if_less`] and similar functions, never with `if`.
///
/// ```
/// use sparse_herglotz::Potential;
/// use contact_geom::{Scalar, nalgebra::SVector};
/// /// A spring between two unknowns with its own stiffness.
/// struct Spring;
/// impl Potential<2, 1> for Spring {
///     #[inline(always)]
///     fn energy<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, c: &[T; 1]) -> T {
///         let r = q[1] - q[0];
///         r * r * c[0] * 0.5
///     }
/// }
/// assert_eq!(Spring.energy(0.0, &[1.0, 3.0].into(), &[2.0]), 4.0);
/// assert_eq!(Spring.gradient(0.0, &[1.0, 3.0].into(), &[2.0])[1], 4.0);
/// ```
pub trait Potential<const K: usize, const P: usize = 0>: Send + Sync + 'static {
    /// The energy `V(t, q; c)`.
    fn energy<T: Scalar>(&self, t: T, q: &SVector<T, K>, c: &[T; P]) -> T;

    /// The gradient `V_q`, by dual numbers unless the term provides it in closed form.
    #[inline(always)]
    fn gradient<T: Scalar>(&self, t: T, q: &SVector<T, K>, c: &[T; P]) -> SVector<T, K> {
        let lifted = std::array::from_fn(|i| {
            let mut x = KernelDual::<T, SVector<T, K>>::constant(q[i]);
            x.d[i] = T::one();
            x
        });
        self.energy(KernelDual::constant(t), &vector(lifted), &c.map(KernelDual::constant)).d
    }
}

/// A potential of the difference `r = q_b - q_a` of unknowns, built from a potential of `r`: a bond. If `W` has one
/// variable, an element is `[a, b]`; if it has two or three, an element is a pair of points, `[a_x, a_y, b_x, b_y]` and
/// so on.
///
/// Its forces on the two ends are exactly opposite, and cost one evaluation of the gradient of `W`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference<W>(pub W);

macro_rules! difference {
    ($($d:literal, $k:literal;)*) => {$(
        impl<W: Potential<$d, P>, const P: usize> Potential<$k, P> for Difference<W> {
            #[inline(always)]
            fn energy<T: Scalar>(&self, t: T, q: &SVector<T, $k>, c: &[T; P]) -> T {
                self.0.energy(t, &vector(std::array::from_fn(|i| q[$d + i] - q[i])), c)
            }
            #[inline(always)]
            fn gradient<T: Scalar>(&self, t: T, q: &SVector<T, $k>, c: &[T; P]) -> SVector<T, $k> {
                let g: SVector<T, $d> = self.0.gradient(t, &vector(std::array::from_fn(|i| q[$d + i] - q[i])), c);
                vector(std::array::from_fn(|i| if i < $d { -g[i] } else { g[i - $d] }))
            }
        }
    )*};
}
difference! { 1, 2; 2, 4; 3, 6; }

/// A vector with these components.
#[inline(always)]
pub(crate) fn vector<T, const K: usize>(x: [T; K]) -> SVector<T, K> {
    SVector::from_array_storage(ArrayStorage([x]))
}
