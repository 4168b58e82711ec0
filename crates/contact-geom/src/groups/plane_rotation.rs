//! The rotations of the plane, SO(2).

use super::lie_group::add_compensated;
use super::stumpff::{arc_tangent_ratio, stumpff};
use super::{GroupError, LieGroup};
use crate::Scalar;
use nalgebra::SVector;

/// The group SO(2) of rotations of the plane. It is commutative, so that Ad and dexp are the identity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlaneRotations {}

/// A rotation of the plane by an angle.
///
/// ```
/// use contact_geom::{groups::{LieGroup, PlaneRotations}, nalgebra::SVector};
/// let g = PlaneRotations::exp(&SVector::from([3.0]));
/// assert!((PlaneRotations::log(&PlaneRotations::compose(&g, &g))[0] - (6.0 - std::f64::consts::TAU)).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneRotation<T = f64> {
    /// The cosine of the angle.
    pub cos: T,
    /// Its sine.
    pub sin: T,
}

impl LieGroup<1> for PlaneRotations {
    type Element<T: Scalar> = PlaneRotation<T>;

    fn identity<T: Scalar>() -> PlaneRotation<T> {
        PlaneRotation { cos: T::one(), sin: T::zero() }
    }

    #[inline]
    fn compose<T: Scalar>(a: &PlaneRotation<T>, b: &PlaneRotation<T>) -> PlaneRotation<T> {
        PlaneRotation { cos: a.cos * b.cos - a.sin * b.sin, sin: a.sin * b.cos + a.cos * b.sin }
    }

    #[inline]
    fn inverse<T: Scalar>(g: &PlaneRotation<T>) -> PlaneRotation<T> {
        PlaneRotation { cos: g.cos, sin: -g.sin }
    }

    #[inline]
    fn exp<T: Scalar>(xi: &SVector<T, 1>) -> PlaneRotation<T> {
        let (sin, cos) = xi[0].sin_cos();
        PlaneRotation { cos, sin }
    }

    /// The angle in `(-pi, pi]`, by two halvings.
    fn log<T: Scalar>(g: &PlaneRotation<T>) -> SVector<T, 1> {
        let (w, turned) = if g.cos.re() < 0.0 { (-g.cos, true) } else { (g.cos, false) };
        let sin = if turned { -g.sin } else { g.sin };
        let ratio = sin / ((sin * sin + w * w).sqrt() + w);
        let angle = ratio * arc_tangent_ratio(ratio * ratio) * 2.0;
        let half_turn = if g.sin.re() < 0.0 { -std::f64::consts::PI } else { std::f64::consts::PI };
        SVector::from([if turned { angle + half_turn } else { angle }])
    }

    #[inline]
    fn adjoint<T: Scalar>(_g: &PlaneRotation<T>, xi: &SVector<T, 1>) -> SVector<T, 1> {
        *xi
    }

    #[inline]
    fn bracket<T: Scalar>(_a: &SVector<T, 1>, _b: &SVector<T, 1>) -> SVector<T, 1> {
        SVector::zeros()
    }

    #[inline]
    fn dexp<T: Scalar>(_xi: &SVector<T, 1>, v: &SVector<T, 1>) -> SVector<T, 1> {
        *v
    }

    #[inline]
    fn dexp_inverse<T: Scalar>(_xi: &SVector<T, 1>, v: &SVector<T, 1>) -> SVector<T, 1> {
        *v
    }

    #[inline]
    fn dexp_gradient<T: Scalar>(_xi: &SVector<T, 1>, _v: &SVector<T, 1>, _mu: &SVector<T, 1>) -> SVector<T, 1> {
        SVector::zeros()
    }

    #[inline]
    fn lift<T: Scalar, S: Scalar>(g: &PlaneRotation<T>, constant: impl Fn(T) -> S + Copy) -> PlaneRotation<S> {
        PlaneRotation { cos: constant(g.cos), sin: constant(g.sin) }
    }

    fn angle(xi: &SVector<f64, 1>) -> f64 {
        xi[0].abs()
    }

    fn check(g: &PlaneRotation) -> Result<(), GroupError> {
        let norm = (g.cos * g.cos + g.sin * g.sin).sqrt();
        if (norm - 1.0).abs() <= 1e-8 { Ok(()) } else { Err(GroupError::NonUnitQuaternion { norm }) }
    }

    fn advance(g: &mut PlaneRotation, rest: &mut PlaneRotation, xi: &SVector<f64, 1>) {
        let c = stumpff(xi[0] * xi[0]);
        let change = PlaneRotation { cos: -xi[0] * xi[0] * c[2], sin: xi[0] * c[1] };
        let step = Self::compose(g, &change);
        *rest = Self::compose(rest, &PlaneRotation { cos: 1.0 + change.cos, sin: change.sin });
        add_compensated(&mut g.cos, &mut rest.cos, step.cos);
        add_compensated(&mut g.sin, &mut rest.sin, step.sin);
        let excess = 0.5 * (1.0 - (g.cos * g.cos + g.sin * g.sin));
        let (cos, sin) = (excess * g.cos, excess * g.sin);
        add_compensated(&mut g.cos, &mut rest.cos, cos);
        add_compensated(&mut g.sin, &mut rest.sin, sin);
    }

    fn null() -> PlaneRotation {
        PlaneRotation { cos: 0.0, sin: 0.0 }
    }
}
