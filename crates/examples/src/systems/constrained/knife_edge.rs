//! The knife edge on an inclined plane.

use contact_geom::constraints::Distribution;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::dot;
use contact_geom::{Lagrangian, Scalar, Structure};

/// A blade of unit mass and unit moment of inertia at `(q0, q1)` in the direction `q2`, on a plane that descends along
/// `q0` with the acceleration `slope = g sin(alpha)`, with linear drag. The blade does not move sideways:
/// `-sin q2 x' + cos q2 y' = 0`.
///
/// Without drag, from rest at the origin with the angular velocity w, `x = slope sin^2(w t)/(2 w^2)` and
/// `y = slope (w t - sin(2 w t)/2)/(2 w^2)`: the blade does not slide down on average.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnifeEdge {
    /// The component of gravity along the plane.
    pub slope: f64,
    /// The rate `L_z`, negative for dissipation.
    pub gamma: f64,
}

impl Lagrangian<3> for KnifeEdge {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 3>, v: &SVector<T, 3>, z: T) -> T {
        dot(v, v) * 0.5 + q[0] * self.slope + z * self.gamma
    }

    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

impl Distribution<3, 1> for KnifeEdge {
    fn omega<T: Scalar>(&self, q: &SVector<T, 3>) -> SMatrix<T, 1, 3> {
        let (s, c) = q[2].sin_cos();
        let row = [-s, c, T::zero()];
        SMatrix::from_fn(|_, i| row[i])
    }
}
