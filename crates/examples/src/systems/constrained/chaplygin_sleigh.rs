//! Chaplygin's sleigh.

use contact_geom::constraints::Distribution;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Lagrangian, Scalar, Structure};

/// A rigid body on a plane with a blade at `(q0, q1)` in the direction `q2`, whose centre of mass is ahead of the blade
/// by `arm`, with linear drag. The blade does not move sideways: `-sin q2 x' + cos q2 y' = 0`.
///
/// Without drag the velocity u along the blade and the angular velocity satisfy `u' = a omega^2`,
/// `omega' = -k u omega` with `k = m a / (I + m a^2)`, hence `u = C tanh(k C t + phi)`,
/// `omega = C sqrt(k/a) sech(k C t + phi)`. With drag the velocities are `e^(gamma t)` times those at the time
/// `tau = (e^(gamma t) - 1)/gamma`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChaplyginSleigh {
    /// The mass m.
    pub mass: f64,
    /// The distance a of the centre of mass from the blade.
    pub arm: f64,
    /// The moment of inertia I about the centre of mass.
    pub inertia: f64,
    /// The rate `L_z`, negative for dissipation.
    pub gamma: f64,
}

impl Lagrangian<3> for ChaplyginSleigh {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 3>, v: &SVector<T, 3>, z: T) -> T {
        let (s, c) = q[2].sin_cos();
        let turn = v[2] * self.arm;
        let (x, y) = (v[0] - turn * s, v[1] + turn * c);
        (x * x + y * y) * (0.5 * self.mass) + v[2] * v[2] * (0.5 * self.inertia) + z * self.gamma
    }

    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, ..Structure::default() }
    }
}

impl Distribution<3, 1> for ChaplyginSleigh {
    fn omega<T: Scalar>(&self, q: &SVector<T, 3>) -> SMatrix<T, 1, 3> {
        let (s, c) = q[2].sin_cos();
        let row = [-s, c, T::zero()];
        SMatrix::from_fn(|_, i| row[i])
    }
}
