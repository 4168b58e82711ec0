//! The pendulum in Cartesian coordinates.

use contact_geom::constraints::Constraint;
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{Lagrangian, Scalar, Structure};

/// A point of unit mass on the unit sphere of R^N under gravity along the last axis, with linear drag:
/// `L = v.v/2 - g q_N + gamma z`, `q.q = 1`. For `N = 2` it is the plane pendulum, for `N = 3` the spherical pendulum,
/// without poles.
///
/// Without drag the plane pendulum from `(1, 0)` at rest has for `g = 9.81` the period
/// `4 K(1/2) / sqrt(g) = 2.367841947576237`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidPendulum<const N: usize> {
    /// The acceleration of gravity.
    pub gravity: f64,
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl<const N: usize> Lagrangian<N> for RigidPendulum<N> {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        let height = q.iter().last().map_or(T::zero(), |y| *y);
        dot(v, v) * 0.5 - height * self.gravity + z * self.gamma
    }

    fn structure(&self) -> Structure {
        Structure {
            autonomous: true,
            z_free: self.gamma == 0.0,
            z_affine: true,
            separable: true,
            constant_mass: true,
            ..Structure::default()
        }
    }
}

impl<const N: usize> Constraint<N, 1> for RigidPendulum<N> {
    fn value<T: Scalar>(&self, q: &SVector<T, N>) -> SVector<T, 1> {
        SVector::from([dot(q, q) - T::one()])
    }
}
