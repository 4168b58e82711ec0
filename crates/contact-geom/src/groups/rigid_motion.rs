//! The rigid motions of space, SE(3).

use super::lie_group::add_compensated;
use super::rotation::cross;
use super::{GroupError, LieGroup, Rotation, Rotations};
use crate::{Dual, Scalar};
use nalgebra::SVector;

/// The group SE(3) of rigid motions `X -> R X + x`. An element of the algebra is an angular velocity and a velocity,
/// both in the body, `(omega, v)`; a momentum is an angular momentum and a linear one.
///
/// The algebra is that of SO(3) over the dual numbers `omega + eps v`, `eps^2 = 0` (the principle of transference), so
/// that brackets and dexp are those of rotations, evaluated on [`Dual`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RigidMotions {}

/// A rigid motion: the attitude and the position of a body.
///
/// ```
/// use contact_geom::{groups::{LieGroup, RigidMotions}, nalgebra::SVector};
/// let screw = SVector::from([0.0, 0.0, std::f64::consts::PI, 0.0, 0.0, 2.0]); // half a turn, and 2 along the axis
/// let g = RigidMotions::exp(&screw);
/// assert!((g.position - SVector::from([0.0, 0.0, 2.0])).amax() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidMotion<T = f64> {
    /// The rotation R.
    pub attitude: Rotation<T>,
    /// The translation x.
    pub position: SVector<T, 3>,
}

/// The angular part and the linear part.
fn parts<T: Scalar>(xi: &SVector<T, 6>) -> (SVector<T, 3>, SVector<T, 3>) {
    (SVector::from([xi[0], xi[1], xi[2]]), SVector::from([xi[3], xi[4], xi[5]]))
}

/// The two parts as one vector.
fn joined<T: Scalar>(a: SVector<T, 3>, b: SVector<T, 3>) -> SVector<T, 6> {
    SVector::from([a[0], a[1], a[2], b[0], b[1], b[2]])
}

/// A vector over the dual numbers with one direction.
type DualVector<T> = SVector<Dual<T, SVector<T, 1>>, 3>;

/// `omega + eps v`.
fn as_dual<T: Scalar>(xi: &SVector<T, 6>) -> DualVector<T> {
    SVector::from([0, 1, 2].map(|k| Dual { re: xi[k], d: SVector::from([xi[k + 3]]) }))
}

/// The vector of which this is the dual form.
fn from_dual<T: Scalar>(xi: &DualVector<T>) -> SVector<T, 6> {
    SVector::from([xi[0].re, xi[1].re, xi[2].re, xi[0].d[0], xi[1].d[0], xi[2].d[0]])
}

impl LieGroup<6> for RigidMotions {
    type Element<T: Scalar> = RigidMotion<T>;

    fn identity<T: Scalar>() -> RigidMotion<T> {
        RigidMotion { attitude: Rotations::identity(), position: SVector::zeros() }
    }

    fn compose<T: Scalar>(a: &RigidMotion<T>, b: &RigidMotion<T>) -> RigidMotion<T> {
        RigidMotion {
            attitude: Rotations::compose(&a.attitude, &b.attitude),
            position: a.attitude.apply(&b.position) + a.position,
        }
    }

    fn inverse<T: Scalar>(g: &RigidMotion<T>) -> RigidMotion<T> {
        RigidMotion { attitude: Rotations::inverse(&g.attitude), position: -g.attitude.apply_inverse(&g.position) }
    }

    /// The translation is the right-trivialised derivative of the rotation, `x = dexp_(-omega) v`.
    fn exp<T: Scalar>(xi: &SVector<T, 6>) -> RigidMotion<T> {
        let (omega, v) = parts(xi);
        RigidMotion { attitude: Rotations::exp(&omega), position: Rotations::dexp(&-omega, &v) }
    }

    fn log<T: Scalar>(g: &RigidMotion<T>) -> SVector<T, 6> {
        let omega = Rotations::log(&g.attitude);
        joined(omega, Rotations::dexp_inverse(&-omega, &g.position))
    }

    fn adjoint<T: Scalar>(g: &RigidMotion<T>, xi: &SVector<T, 6>) -> SVector<T, 6> {
        let (omega, v) = parts(xi);
        let turned = g.attitude.apply(&omega);
        joined(turned, g.attitude.apply(&v) + cross(&g.position, &turned))
    }

    fn coadjoint<T: Scalar>(g: &RigidMotion<T>, mu: &SVector<T, 6>) -> SVector<T, 6> {
        let (angular, linear) = parts(mu);
        let moment = angular + cross(&linear, &g.position);
        joined(g.attitude.apply_inverse(&moment), g.attitude.apply_inverse(&linear))
    }

    fn bracket<T: Scalar>(a: &SVector<T, 6>, b: &SVector<T, 6>) -> SVector<T, 6> {
        from_dual(&cross(&as_dual(a), &as_dual(b)))
    }

    fn dexp<T: Scalar>(xi: &SVector<T, 6>, v: &SVector<T, 6>) -> SVector<T, 6> {
        from_dual(&Rotations::dexp(&as_dual(xi), &as_dual(v)))
    }

    fn dexp_inverse<T: Scalar>(xi: &SVector<T, 6>, v: &SVector<T, 6>) -> SVector<T, 6> {
        from_dual(&Rotations::dexp_inverse(&as_dual(xi), &as_dual(v)))
    }

    fn lift<T: Scalar, S: Scalar>(g: &RigidMotion<T>, constant: impl Fn(T) -> S + Copy) -> RigidMotion<S> {
        RigidMotion { attitude: Rotations::lift(&g.attitude, constant), position: g.position.map(constant) }
    }

    fn angle(xi: &SVector<f64, 6>) -> f64 {
        parts(xi).0.norm()
    }

    fn check(g: &RigidMotion) -> Result<(), GroupError> {
        Rotations::check(&g.attitude)?;
        match g.position.iter().find(|x| !x.is_finite()) {
            Some(&value) => Err(GroupError::NonFinite { what: "a coordinate of the position", value }),
            None => Ok(()),
        }
    }

    fn advance(g: &mut RigidMotion, rest: &mut RigidMotion, xi: &SVector<f64, 6>) {
        let (omega, v) = parts(xi);
        let change = g.attitude.apply(&Rotations::dexp(&-omega, &v));
        for k in 0..3 {
            add_compensated(&mut g.position[k], &mut rest.position[k], change[k]);
        }
        Rotations::advance(&mut g.attitude, &mut rest.attitude, &omega);
    }

    fn null() -> RigidMotion {
        RigidMotion { attitude: Rotations::null(), position: SVector::zeros() }
    }
}
