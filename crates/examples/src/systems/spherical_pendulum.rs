//! The damped spherical pendulum.

use super::{System, between, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{Lagrangian, PhasePoint, Scalar, Structure, Symmetry, VelocityPoint};

/// The spherical pendulum with linear drag, `L = (v_theta^2 + sin^2 theta v_phi^2)/2 - (1 - cos theta) + gamma z`, with
/// `q = (theta, phi)`: the angle from the downward vertical, and the azimuth. Dimensionless: time in units of
/// `sqrt(l/g)`.
///
/// Herglotz' equations are `theta'' = sin theta cos theta phi'^2 - sin theta + gamma theta'` and
/// `(sin^2 theta phi')' = gamma sin^2 theta phi'`; nonlinear. `W = diag(1, sin^2 theta)` depends on the position, and
/// is singular at the two poles of the chart, `theta = 0` and `pi`. Rotations about the vertical are a symmetry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalPendulum {
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl Default for SphericalPendulum {
    fn default() -> Self {
        SphericalPendulum { gamma: -0.1 }
    }
}

impl SphericalPendulum {
    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        &self,
        [gamma]: [C; 1],
        _t: T,
        q: &SVector<T, 2>,
        v: &SVector<T, 2>,
        z: T,
    ) -> T {
        let around = q[0].sin() * v[1];
        (v[0] * v[0] + around * around) * 0.5 - q[0].versine() + z * gamma
    }
}

impl Lagrangian<2> for SphericalPendulum {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        self.formula([self.gamma], t, q, v, z)
    }

    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: self.gamma == 0.0, z_affine: true, ..Structure::default() }
    }
}

parametric_fields!([] SphericalPendulum, 2, gamma);

impl System<2> for SphericalPendulum {
    fn name(&self) -> &'static str {
        "spherical_pendulum"
    }

    fn initial(&self) -> VelocityPoint<2> {
        VelocityPoint::new([1.0, 0.0], [0.0, 1.2], 0.0)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<2>) {
        let q = [between(0.3, 2.8, u[0]), between(-3.0, 3.0, u[1])];
        let v = [between(-2.0, 2.0, u[2]), between(-2.0, 2.0, u[3])];
        (between(0.0, 5.0, u[5]), VelocityPoint::new(q, v, between(-1.0, 1.0, u[4])))
    }

    fn hamiltonian<T: Scalar>(&self, _t: T, x: &PhasePoint<2, T>) -> Option<T> {
        let around = x.p[1] / x.q[0].sin();
        Some((x.p[0] * x.p[0] + around * around) * 0.5 + x.q[0].versine() - x.z * self.gamma)
    }

    fn symmetries(&self) -> Vec<Symmetry<2>> {
        vec![Symmetry::Translation(SVector::from([0.0, 1.0]))]
    }
}
