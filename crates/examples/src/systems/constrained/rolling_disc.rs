//! The vertical rolling disc.

use contact_geom::constraints::Distribution;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Lagrangian, Scalar, Structure};

/// A vertical disc that rolls on a plane without sliding, with linear drag: `q = (x, y, theta, phi)`, the point of
/// contact, the angle of rotation about the axis, and the heading. `x' = R cos(phi) theta'`, `y' = R sin(phi) theta'`.
///
/// Without drag `theta'` and `phi'` are constant and the point of contact moves on a circle of the radius
/// `R theta'/phi'`; with drag the same circle is traversed in the time `tau = (e^(gamma t) - 1)/gamma`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RollingDisc {
    /// The radius R.
    pub radius: f64,
    /// The mass.
    pub mass: f64,
    /// The moment of inertia about the axis.
    pub spin_inertia: f64,
    /// The moment of inertia about a diameter.
    pub turn_inertia: f64,
    /// The rate `L_z`, negative for dissipation.
    pub gamma: f64,
}

impl Lagrangian<4> for RollingDisc {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 4>, v: &SVector<T, 4>, z: T) -> T {
        (v[0] * v[0] + v[1] * v[1]) * (0.5 * self.mass)
            + v[2] * v[2] * (0.5 * self.spin_inertia)
            + v[3] * v[3] * (0.5 * self.turn_inertia)
            + z * self.gamma
    }

    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

impl Distribution<4, 2> for RollingDisc {
    fn omega<T: Scalar>(&self, q: &SVector<T, 4>) -> SMatrix<T, 2, 4> {
        let (s, c) = q[3].sin_cos();
        let (one, zero) = (T::one(), T::zero());
        let rows = [[one, zero, -c * self.radius, zero], [zero, one, -s * self.radius, zero]];
        SMatrix::from_fn(|a, i| rows[a][i])
    }
}
