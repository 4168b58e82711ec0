//! The translations of R^n.

use super::lie_group::add_compensated;
use super::{GroupError, LieGroup};
use crate::Scalar;
use nalgebra::SVector;

/// The group R^N of translations, whose exponential map is the identity. On it everything is as in a flat chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Translations<const N: usize> {}

impl<const N: usize> LieGroup<N> for Translations<N> {
    type Element<T: Scalar> = SVector<T, N>;

    fn identity<T: Scalar>() -> SVector<T, N> {
        SVector::zeros()
    }

    #[inline]
    fn compose<T: Scalar>(a: &SVector<T, N>, b: &SVector<T, N>) -> SVector<T, N> {
        a + b
    }

    #[inline]
    fn inverse<T: Scalar>(g: &SVector<T, N>) -> SVector<T, N> {
        -g
    }

    #[inline]
    fn exp<T: Scalar>(xi: &SVector<T, N>) -> SVector<T, N> {
        *xi
    }

    #[inline]
    fn log<T: Scalar>(g: &SVector<T, N>) -> SVector<T, N> {
        *g
    }

    #[inline]
    fn adjoint<T: Scalar>(_g: &SVector<T, N>, xi: &SVector<T, N>) -> SVector<T, N> {
        *xi
    }

    #[inline]
    fn coadjoint<T: Scalar>(_g: &SVector<T, N>, mu: &SVector<T, N>) -> SVector<T, N> {
        *mu
    }

    #[inline]
    fn bracket<T: Scalar>(_a: &SVector<T, N>, _b: &SVector<T, N>) -> SVector<T, N> {
        SVector::zeros()
    }

    #[inline]
    fn cobracket<T: Scalar>(_a: &SVector<T, N>, _mu: &SVector<T, N>) -> SVector<T, N> {
        SVector::zeros()
    }

    #[inline]
    fn dexp<T: Scalar>(_xi: &SVector<T, N>, v: &SVector<T, N>) -> SVector<T, N> {
        *v
    }

    #[inline]
    fn dexp_inverse<T: Scalar>(_xi: &SVector<T, N>, v: &SVector<T, N>) -> SVector<T, N> {
        *v
    }

    #[inline]
    fn dexp_transposed<T: Scalar>(_xi: &SVector<T, N>, mu: &SVector<T, N>) -> SVector<T, N> {
        *mu
    }

    #[inline]
    fn dexp_inverse_transposed<T: Scalar>(_xi: &SVector<T, N>, p: &SVector<T, N>) -> SVector<T, N> {
        *p
    }

    #[inline]
    fn dexp_gradient<T: Scalar>(_xi: &SVector<T, N>, _v: &SVector<T, N>, _mu: &SVector<T, N>) -> SVector<T, N> {
        SVector::zeros()
    }

    #[inline]
    fn lift<T: Scalar, S: Scalar>(g: &SVector<T, N>, constant: impl Fn(T) -> S + Copy) -> SVector<S, N> {
        g.map(constant)
    }

    fn angle(_xi: &SVector<f64, N>) -> f64 {
        0.0
    }

    fn check(g: &SVector<f64, N>) -> Result<(), GroupError> {
        match g.iter().find(|x| !x.is_finite()) {
            Some(&value) => Err(GroupError::NonFinite { what: "a coordinate", value }),
            None => Ok(()),
        }
    }

    fn advance(g: &mut SVector<f64, N>, rest: &mut SVector<f64, N>, xi: &SVector<f64, N>) {
        for k in 0..N {
            add_compensated(&mut g[k], &mut rest[k], xi[k]);
        }
    }

    fn null() -> SVector<f64, N> {
        SVector::zeros()
    }
}
