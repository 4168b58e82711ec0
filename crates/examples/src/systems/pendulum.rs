//! The damped pendulum.

use super::{System, between, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{ChartVector, Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint};

/// The pendulum with linear drag, `L = v^2/2 - (1 - cos q) + gamma z`. Dimensionless: time in units of `sqrt(l/g)`, `q`
/// the angle from the lower equilibrium.
///
/// Herglotz' equation is `q'' = -sin q + gamma q'`; nonlinear, W = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pendulum {
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl Default for Pendulum {
    fn default() -> Self {
        Pendulum { gamma: -0.1 }
    }
}

impl Pendulum {
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
        v[0] * v[0] * 0.5 - q[0].versine() + z * gamma
    }
}

impl Lagrangian<1> for Pendulum {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        self.formula([self.gamma], t, q, v, z)
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, _t: T, x: &VelocityPoint<1, T>) -> Option<ChartVector<1, T>> {
        Some(ChartVector { x: SVector::from([-x.q[0].sin()]), y: x.v, z: T::from(self.gamma) })
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

parametric_fields!([] Pendulum, 1, gamma);

impl System<1> for Pendulum {
    fn name(&self) -> &'static str {
        "pendulum"
    }

    fn initial(&self) -> VelocityPoint<1> {
        VelocityPoint::new([1.0], [1.0], 0.0)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<1>) {
        let x = VelocityPoint::new([between(-3.0, 3.0, u[0])], [between(-2.0, 2.0, u[1])], between(-1.0, 1.0, u[2]));
        (between(0.0, 5.0, u[3]), x)
    }

    fn hamiltonian<T: Scalar>(&self, _t: T, x: &PhasePoint<1, T>) -> Option<T> {
        Some(x.p[0] * x.p[0] * 0.5 + x.q[0].versine() - x.z * self.gamma)
    }
}
