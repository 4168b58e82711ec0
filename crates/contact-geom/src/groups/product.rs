//! Products of groups.

use super::{GroupError, LieGroup};
use crate::Scalar;
use nalgebra::SVector;
use std::fmt::Debug;
use std::marker::PhantomData;

/// The product `A x B` of a group of dimension NA and one of dimension NB; it has dimension `N = NA + NB`, which is
/// checked when a program is compiled. A system of several bodies is a product.
///
/// ```
/// use contact_geom::{groups::{LieGroup, Product, Rotations, Translations}, nalgebra::SVector};
/// type SlidingBody = Product<Rotations, Translations<1>, 3, 1>;
/// let g = <SlidingBody as LieGroup<4>>::exp(&SVector::from([0.1, 0.2, 0.3, 5.0]));
/// assert_eq!(g.b[0], 5.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Product<A, B, const NA: usize, const NB: usize>(PhantomData<(A, B)>);

/// An element of a product.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair<A, B> {
    /// The element of the first group.
    pub a: A,
    /// The element of the second group.
    pub b: B,
}

/// The components of the first and of the second algebra.
fn parts<T: Scalar, const N: usize, const NA: usize, const NB: usize>(
    xi: &SVector<T, N>,
) -> (SVector<T, NA>, SVector<T, NB>) {
    const { assert!(N == NA + NB, "the dimension of a product is the sum of those of its factors") };
    (SVector::from_fn(|i, _| xi[i]), SVector::from_fn(|i, _| xi[NA + i]))
}

/// The components of both as one vector.
fn joined<T: Scalar, const N: usize, const NA: usize, const NB: usize>(
    (a, b): (SVector<T, NA>, SVector<T, NB>),
) -> SVector<T, N> {
    const { assert!(N == NA + NB, "the dimension of a product is the sum of those of its factors") };
    SVector::from_fn(|i, _| if i < NA { a[i] } else { b[i - NA] })
}

/// The same map of both algebras.
macro_rules! by_factor {
    ($map:ident, $xi:ident, $v:ident) => {{
        let ((a, b), (va, vb)) = (parts::<T, N, NA, NB>($xi), parts::<T, N, NA, NB>($v));
        joined((A::$map(&a, &va), B::$map(&b, &vb)))
    }};
}

impl<A, B, const NA: usize, const NB: usize, const N: usize> LieGroup<N> for Product<A, B, NA, NB>
where
    A: LieGroup<NA>,
    B: LieGroup<NB>,
{
    type Element<T: Scalar> = Pair<A::Element<T>, B::Element<T>>;

    fn identity<T: Scalar>() -> Self::Element<T> {
        Pair { a: A::identity(), b: B::identity() }
    }

    fn compose<T: Scalar>(x: &Self::Element<T>, y: &Self::Element<T>) -> Self::Element<T> {
        Pair { a: A::compose(&x.a, &y.a), b: B::compose(&x.b, &y.b) }
    }

    fn inverse<T: Scalar>(g: &Self::Element<T>) -> Self::Element<T> {
        Pair { a: A::inverse(&g.a), b: B::inverse(&g.b) }
    }

    fn exp<T: Scalar>(xi: &SVector<T, N>) -> Self::Element<T> {
        let (a, b) = parts::<T, N, NA, NB>(xi);
        Pair { a: A::exp(&a), b: B::exp(&b) }
    }

    fn log<T: Scalar>(g: &Self::Element<T>) -> SVector<T, N> {
        joined((A::log(&g.a), B::log(&g.b)))
    }

    fn adjoint<T: Scalar>(g: &Self::Element<T>, xi: &SVector<T, N>) -> SVector<T, N> {
        let (a, b) = parts::<T, N, NA, NB>(xi);
        joined((A::adjoint(&g.a, &a), B::adjoint(&g.b, &b)))
    }

    fn coadjoint<T: Scalar>(g: &Self::Element<T>, mu: &SVector<T, N>) -> SVector<T, N> {
        let (a, b) = parts::<T, N, NA, NB>(mu);
        joined((A::coadjoint(&g.a, &a), B::coadjoint(&g.b, &b)))
    }

    fn bracket<T: Scalar>(x: &SVector<T, N>, y: &SVector<T, N>) -> SVector<T, N> {
        by_factor!(bracket, x, y)
    }

    fn cobracket<T: Scalar>(x: &SVector<T, N>, mu: &SVector<T, N>) -> SVector<T, N> {
        by_factor!(cobracket, x, mu)
    }

    fn dexp<T: Scalar>(xi: &SVector<T, N>, v: &SVector<T, N>) -> SVector<T, N> {
        by_factor!(dexp, xi, v)
    }

    fn dexp_inverse<T: Scalar>(xi: &SVector<T, N>, v: &SVector<T, N>) -> SVector<T, N> {
        by_factor!(dexp_inverse, xi, v)
    }

    fn dexp_transposed<T: Scalar>(xi: &SVector<T, N>, mu: &SVector<T, N>) -> SVector<T, N> {
        by_factor!(dexp_transposed, xi, mu)
    }

    fn dexp_inverse_transposed<T: Scalar>(xi: &SVector<T, N>, p: &SVector<T, N>) -> SVector<T, N> {
        by_factor!(dexp_inverse_transposed, xi, p)
    }

    fn dexp_gradient<T: Scalar>(xi: &SVector<T, N>, v: &SVector<T, N>, mu: &SVector<T, N>) -> SVector<T, N> {
        let ((a, b), (va, vb)) = (parts::<T, N, NA, NB>(xi), parts::<T, N, NA, NB>(v));
        let (ma, mb) = parts::<T, N, NA, NB>(mu);
        joined((A::dexp_gradient(&a, &va, &ma), B::dexp_gradient(&b, &vb, &mb)))
    }

    fn lift<T: Scalar, S: Scalar>(g: &Self::Element<T>, constant: impl Fn(T) -> S + Copy) -> Self::Element<S> {
        Pair { a: A::lift(&g.a, constant), b: B::lift(&g.b, constant) }
    }

    fn angle(xi: &SVector<f64, N>) -> f64 {
        let (a, b) = parts::<f64, N, NA, NB>(xi);
        let (a, b) = (A::angle(&a), B::angle(&b));
        if b > a { b } else { a }
    }

    fn check(g: &Self::Element<f64>) -> Result<(), GroupError> {
        A::check(&g.a)?;
        B::check(&g.b)
    }

    fn advance(g: &mut Self::Element<f64>, rest: &mut Self::Element<f64>, xi: &SVector<f64, N>) {
        let (a, b) = parts::<f64, N, NA, NB>(xi);
        A::advance(&mut g.a, &mut rest.a, &a);
        B::advance(&mut g.b, &mut rest.b, &b);
    }

    fn null() -> Self::Element<f64> {
        Pair { a: A::null(), b: B::null() }
    }
}
