//! Vectors from a function of the index and products of vectors, for code that runs in SIMD lanes.

use crate::Scalar;
use nalgebra::SVector;
use std::borrow::Borrow;

/// The vector whose components are the values of a function of the index; [`vector`](macro@crate::vector) calls it with a closure that
/// is always inlined.
#[inline(always)]
#[allow(clippy::needless_range_loop, reason = "an iterator is compiled once more for each type of number")]
pub fn vector_of<T: Scalar, const N: usize>(of: impl Fn(usize) -> T) -> SVector<T, N> {
    let mut x = [T::zero(); N];
    for i in 0..N {
        x[i] = of(i);
    }
    x.into()
}

/// The product `a . b` of two vectors, for Lagrangians, forces and Hamiltonians.
///
/// That of nalgebra has code for long vectors in addition, which is compiled once more for each type of number: with many types
/// of differentials it was a tenth of all code.
///
/// ```
/// use contact_geom::nalgebra::SVector;
/// let v = SVector::from([1.0, -2.0]);
/// assert_eq!(contact_geom::numbers::dot(v, &v), 5.0);
/// ```
#[inline(always)]
pub fn dot<T: Scalar, const N: usize>(a: impl Borrow<SVector<T, N>>, b: impl Borrow<SVector<T, N>>) -> T {
    let (a, b) = (&a.borrow().data.0[0], &b.borrow().data.0[0]);
    if N == 0 {
        return T::zero();
    }
    let mut sum = a[0] * b[0];
    for i in 1..N {
        sum += a[i] * b[i];
    }
    sum
}

/// A vector from the formula of its components, `vector!(|i| ...)` with the index i, for Lagrangians, forces and
/// Hamiltonians.
///
/// Integrators evaluate them in SIMD lanes. The closure is always inlined into their kernels; that of nalgebra's `from_fn`
/// may be compiled as a separate function, which has no vector instructions.
///
/// ```
/// use contact_geom::nalgebra::SVector;
/// let v = SVector::from([1.0, -2.0]);
/// let drag: SVector<f64, 2> = contact_geom::vector!(|i| -(v[i] * 0.5));
/// assert_eq!(drag, SVector::from([-0.5, 1.0]));
/// ```
#[macro_export]
macro_rules! vector {
    (|$i:pat_param| $of:expr) => {
        $crate::numbers::vector_of(
            #[inline(always)]
            |$i| $of,
        )
    };
}
