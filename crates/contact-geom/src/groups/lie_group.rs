//! Lie groups with their exponential map.

use super::GroupError;
use crate::{Dual, Scalar};
use nalgebra::SVector;
use std::fmt::Debug;

/// A Lie group of dimension N with its exponential map, left-trivialised, over any [`Scalar`].
///
/// The algebra is R^N with the bracket [`bracket`](Self::bracket), its dual is R^N with the pairing `mu . xi`. The
/// derivative of exp is left-trivialised throughout: `exp(xi)^-1 d exp(xi) = dexp_xi(d xi)`, hence
/// `dexp_xi = (1 - e^(-ad_xi))/ad_xi`; the right-trivialised one is `dexp_(-xi)`. Source: Iserles, Munthe-Kaas, Norsett
/// and Zanna, Acta Numerica 9 (2000) 215-365, section 2.5, with the opposite sign of xi.
///
/// ```
/// use contact_geom::{groups::{LieGroup, Rotations}, nalgebra::SVector};
/// let xi = SVector::from([0.3, -0.2, 0.5]);
/// let g = Rotations::exp(&xi);
/// assert!((Rotations::log(&g) - xi).amax() < 1e-15);
/// // g exp(eta) g^-1 = exp(Ad_g eta)
/// let eta = SVector::from([1.0, 0.0, 0.2]);
/// let conjugate = Rotations::compose(&Rotations::compose(&g, &Rotations::exp(&eta)), &Rotations::inverse(&g));
/// assert!((Rotations::log(&conjugate) - Rotations::adjoint(&g, &eta)).amax() < 1e-15);
/// ```
pub trait LieGroup<const N: usize>: 'static {
    /// The elements, over a number type.
    type Element<T: Scalar>: Copy + Debug + PartialEq;

    /// The neutral element.
    fn identity<T: Scalar>() -> Self::Element<T>;

    /// The product `a b`.
    fn compose<T: Scalar>(a: &Self::Element<T>, b: &Self::Element<T>) -> Self::Element<T>;

    /// The inverse.
    fn inverse<T: Scalar>(g: &Self::Element<T>) -> Self::Element<T>;

    /// The exponential map.
    fn exp<T: Scalar>(xi: &SVector<T, N>) -> Self::Element<T>;

    /// The inverse of the exponential map near the neutral element: for rotations the vector of the smallest angle.
    fn log<T: Scalar>(g: &Self::Element<T>) -> SVector<T, N>;

    /// `Ad_g xi = g xi g^-1`.
    fn adjoint<T: Scalar>(g: &Self::Element<T>, xi: &SVector<T, N>) -> SVector<T, N>;

    /// The transpose `Ad_g^T mu`: the body momentum of a spatial momentum mu at g.
    #[inline]
    fn coadjoint<T: Scalar>(g: &Self::Element<T>, mu: &SVector<T, N>) -> SVector<T, N> {
        transposed(mu, |e| Self::adjoint(g, e))
    }

    /// The bracket `[a, b] = ad_a b`.
    fn bracket<T: Scalar>(a: &SVector<T, N>, b: &SVector<T, N>) -> SVector<T, N>;

    /// The transpose `ad_a^T mu`.
    #[inline]
    fn cobracket<T: Scalar>(a: &SVector<T, N>, mu: &SVector<T, N>) -> SVector<T, N> {
        transposed(mu, |e| Self::bracket(a, e))
    }

    /// `dexp_xi v`, left-trivialised: the body velocity of `g0 exp(xi(t))` for `v = xidot`.
    fn dexp<T: Scalar>(xi: &SVector<T, N>, v: &SVector<T, N>) -> SVector<T, N>;

    /// `dexp_xi^-1 v`. It is singular where an eigenvalue of `ad_xi` is a multiple of 2 pi i.
    fn dexp_inverse<T: Scalar>(xi: &SVector<T, N>, v: &SVector<T, N>) -> SVector<T, N>;

    /// The transpose `dexp_xi^T mu`: the momentum in the chart, of a body momentum mu.
    #[inline]
    fn dexp_transposed<T: Scalar>(xi: &SVector<T, N>, mu: &SVector<T, N>) -> SVector<T, N> {
        transposed(mu, |e| Self::dexp(xi, e))
    }

    /// The transpose `dexp_xi^-T p`: the body momentum of a momentum p in the chart.
    #[inline]
    fn dexp_inverse_transposed<T: Scalar>(xi: &SVector<T, N>, p: &SVector<T, N>) -> SVector<T, N> {
        transposed(p, |e| Self::dexp_inverse(xi, e))
    }

    /// The gradient of `mu . dexp_xi v` in xi, for fixed v and mu.
    fn dexp_gradient<T: Scalar>(xi: &SVector<T, N>, v: &SVector<T, N>, mu: &SVector<T, N>) -> SVector<T, N> {
        let lifted = |x: &SVector<T, N>| x.map(Dual::<T, SVector<T, N>>::constant);
        let mut seeded = lifted(xi);
        for i in 0..N {
            seeded[i].d[i] = T::one();
        }
        lifted(mu).dot(&Self::dexp(&seeded, &lifted(v))).d
    }

    /// The element with each of its coordinates as a constant of a number type that extends T.
    fn lift<T: Scalar, S: Scalar>(g: &Self::Element<T>, constant: impl Fn(T) -> S + Copy) -> Self::Element<S>;

    /// The largest angle by which `exp(xi)` turns, the size that the chart `xi -> g0 exp(xi)` limits to pi; 0 for
    /// groups whose exponential map is a global chart.
    fn angle(xi: &SVector<f64, N>) -> f64;

    /// Checks that the coordinates of an element satisfy their equations, as the norm of a quaternion.
    ///
    /// # Errors
    /// The [`GroupError`] that names the violated equation.
    fn check(g: &Self::Element<f64>) -> Result<(), GroupError>;

    /// Replaces g by `g exp(xi)`, with compensated summation of its coordinates: `rest` has what rounding has lost, and
    /// is null at the start ([`null`](Self::null)). Errors of many small steps then do not add up.
    fn advance(g: &mut Self::Element<f64>, rest: &mut Self::Element<f64>, xi: &SVector<f64, N>);

    /// The coordinates 0, a start for the rest of [`advance`](Self::advance); it need not be an element.
    fn null() -> Self::Element<f64>;
}

/// `A^T mu` for a linear map A.
#[inline]
fn transposed<T: Scalar, const N: usize>(
    mu: &SVector<T, N>,
    a: impl Fn(&SVector<T, N>) -> SVector<T, N>,
) -> SVector<T, N> {
    SVector::from_fn(|i, _| {
        let mut e = SVector::<T, N>::zeros();
        e[i] = T::one();
        mu.dot(&a(&e))
    })
}

/// Adds a change to a coordinate with compensated summation.
#[inline]
pub(super) fn add_compensated(value: &mut f64, rest: &mut f64, change: f64) {
    let change = change + *rest;
    let sum = *value + change;
    let of_change = sum - *value;
    *rest = (*value - (sum - of_change)) + (change - of_change);
    *value = sum;
}
