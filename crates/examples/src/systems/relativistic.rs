//! The relativistic oscillator with drag.

use super::{System, between, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint};

/// A relativistic particle on a spring, with drag: `L = -sqrt(1 - v^2) - q^2/2 + gamma z`, `|v| < 1`. Dimensionless:
/// rest mass, spring constant and speed of light one.
///
/// Herglotz' equation is `p' = -q + gamma p` with `p = v / sqrt(1 - v^2)`; nonlinear through the kinetic term alone.
/// `W = (1 - v^2)^(-3/2)` depends on the velocity and is unbounded as `|v|` approaches 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relativistic {
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl Default for Relativistic {
    fn default() -> Self {
        Relativistic { gamma: -0.1 }
    }
}

impl Relativistic {
    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        &self,
        [gamma]: [C; 1],
        _t: T,
        q: &SVector<T, 1>,
        v: &SVector<T, 1>,
        z: T,
    ) -> T {
        // As a product, 1 - v^2 is accurate near the speed of light.
        let proper = ((-v[0] + 1.0) * (v[0] + 1.0)).sqrt();
        z * gamma - q[0] * q[0] * 0.5 - proper
    }
}

impl Lagrangian<1> for Relativistic {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        self.formula([self.gamma], t, q, v, z)
    }

    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: self.gamma == 0.0, z_affine: true, ..Structure::default() }
    }
}

parametric_fields!([] Relativistic, 1, gamma);

impl System<1> for Relativistic {
    fn name(&self) -> &'static str {
        "relativistic"
    }

    fn initial(&self) -> VelocityPoint<1> {
        VelocityPoint::new([1.0], [0.0], 0.0)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<1>) {
        let x = VelocityPoint::new([between(-2.0, 2.0, u[0])], [between(-0.8, 0.8, u[1])], between(-1.0, 1.0, u[2]));
        (between(0.0, 5.0, u[3]), x)
    }

    fn hamiltonian<T: Scalar>(&self, _t: T, x: &PhasePoint<1, T>) -> Option<T> {
        Some((x.p[0] * x.p[0] + 1.0).sqrt() + x.q[0] * x.q[0] * 0.5 - x.z * self.gamma)
    }
}
