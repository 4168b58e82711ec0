//! A Lagrangian in which position, velocity and action are all coupled.

use super::{System, between, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint};

/// A pendulum whose inertia depends on its position and its action, and grows with its speed:
/// `L = (1 + a cos q cos z) v^2/2 + b v^4/4 - (1 - cos q) + gamma z`, with `|a| < 1` and `b >= 0`. Dimensionless, like
/// [`Pendulum`](super::Pendulum).
///
/// With `m = 1 + a cos q cos z` Herglotz' equation is
/// `(m + 3 b v^2) q'' = -m_q v^2/2 - m_z v L - sin q + (m v + b v^3) (gamma + m_z v^2/2)`. `W = m + 3 b v^2` depends on
/// all of q, v and z, and is at least `1 - |a|` everywhere. The system is autonomous and has no other structure, so
/// that it tests statements for general regular L. For `b > 0` there is no formula for H, since v as a function of p is
/// the root of a cubic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoupledInZ {
    /// The strength of the dependence of the inertia on position and action; below one in absolute value.
    pub a: f64,
    /// The strength of the growth of the inertia with the speed; not negative.
    pub b: f64,
    /// The part of `L_z` that does not depend on the state, negative for dissipation.
    pub gamma: f64,
}

impl Default for CoupledInZ {
    fn default() -> Self {
        CoupledInZ { a: 0.5, b: 0.1, gamma: -0.1 }
    }
}

impl CoupledInZ {
    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        &self,
        [a, b, gamma]: [C; 3],
        _t: T,
        q: &SVector<T, 1>,
        v: &SVector<T, 1>,
        z: T,
    ) -> T {
        let square = v[0] * v[0];
        let inertia = q[0].cos() * z.cos() * a + 1.0;
        square * (inertia * 0.5 + square * (b * 0.25)) - q[0].versine() + z * gamma
    }
}

impl Lagrangian<1> for CoupledInZ {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        self.formula([self.a, self.b, self.gamma], t, q, v, z)
    }

    fn structure(&self) -> Structure {
        let decoupled = self.a == 0.0;
        let constant = decoupled && self.b == 0.0;
        Structure {
            autonomous: true,
            z_free: decoupled && self.gamma == 0.0,
            z_affine: decoupled,
            separable: constant,
            quadratic: false,
            constant_mass: constant,
            ..Structure::default()
        }
    }
}

parametric_fields!([] CoupledInZ, 1, a, b, gamma);

impl System<1> for CoupledInZ {
    fn name(&self) -> &'static str {
        "coupled_in_z"
    }

    fn initial(&self) -> VelocityPoint<1> {
        VelocityPoint::new([1.0], [1.0], 0.5)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<1>) {
        let x = VelocityPoint::new([between(-3.0, 3.0, u[0])], [between(-2.0, 2.0, u[1])], between(-3.0, 3.0, u[2]));
        (between(0.0, 5.0, u[3]), x)
    }

    fn hamiltonian<T: Scalar>(&self, _t: T, x: &PhasePoint<1, T>) -> Option<T> {
        // Without the quartic term the fibre derivative is linear in v.
        (self.b == 0.0).then(|| {
            let inertia = x.q[0].cos() * x.z.cos() * self.a + 1.0;
            x.p[0] * x.p[0] / inertia * 0.5 + x.q[0].versine() - x.z * self.gamma
        })
    }
}
