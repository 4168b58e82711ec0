//! The plane four-bar linkage.

use super::{length, point, rod};
use contact_geom::constraints::Constraint;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// A closed chain of three uniform rods of unit mass in a vertical plane, with linear drag: a crank from `(0, 0)` to
/// the pivot `(q0, q1)`, a coupler to the pivot `(q2, q3)`, and a rocker to `(base, 0)`. One degree of freedom.
///
/// In the coordinates of the pivots the mass matrix is constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FourBar {
    /// The length of the crank.
    pub crank: f64,
    /// The length of the coupler.
    pub coupler: f64,
    /// The length of the rocker.
    pub rocker: f64,
    /// The distance of the two fixed pivots.
    pub base: f64,
    /// The acceleration of gravity.
    pub gravity: f64,
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl Default for FourBar {
    fn default() -> Self {
        FourBar { crank: 1.0, coupler: 2.0, rocker: 1.8, base: 2.2, gravity: 1.0, gamma: -0.1 }
    }
}

impl FourBar {
    /// The positions of the pivots for an angle of the crank, with the rocker above the line of the other two;
    /// NaN where the chain does not close.
    pub fn closed_at(&self, angle: f64) -> SVector<f64, 4> {
        let (s, c) = angle.sin_cos();
        let a = [self.crank * c, self.crank * s];
        let (x, y) = (self.base - a[0], -a[1]);
        let distance = x.hypot(y);
        // The foot of the pivot on the line from the crank to the base, by the law of cosines.
        let along = (distance.powi(2) + self.coupler.powi(2) - self.rocker.powi(2)) / (2.0 * distance);
        let across = (self.coupler.powi(2) - along.powi(2)).sqrt();
        let (ex, ey) = (x / distance, y / distance);
        SVector::from([a[0], a[1], a[0] + along * ex - across * ey, a[1] + along * ey + across * ex])
    }
}

impl Lagrangian<4> for FourBar {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 4>, v: &SVector<T, 4>, z: T) -> T {
        let zero = [T::zero(); 2];
        let base = [T::from(self.base), T::zero()];
        rod(zero, point(q, 0), zero, point(v, 0), self.gravity)
            + rod(point(q, 0), point(q, 1), point(v, 0), point(v, 1), self.gravity)
            + rod(point(q, 1), base, point(v, 1), zero, self.gravity)
            + z * self.gamma
    }

    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

impl Constraint<4, 3> for FourBar {
    fn value<T: Scalar>(&self, q: &SVector<T, 4>) -> SVector<T, 3> {
        SVector::from([
            length(point(q, 0), [T::zero(); 2], self.crank),
            length(point(q, 1), point(q, 0), self.coupler),
            length(point(q, 1), [T::from(self.base), T::zero()], self.rocker),
        ])
    }
}
