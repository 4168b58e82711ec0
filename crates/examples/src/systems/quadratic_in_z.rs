//! The oscillator whose Lagrangian is quadratic in the action.

use super::{System, between, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{ChartVector, Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint};

/// The oscillator with a drag proportional to the action, `L = v^2/2 - q^2/2 - c z^2/2`. Dimensionless: time in units
/// of the inverse frequency of the undamped oscillator.
///
/// Herglotz' equation is `q'' = -q - c z q'`, coupled to `z' = L`; nonlinear through z alone, W = 1. The conformal
/// factor's rate `-c z` depends on the motion: the simplest case in which z does not decouple. Vermeeren, Bravetti and
/// Seri, "Contact variational integrators", J. Phys. A 52 (2019), treat it as an example.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraticInZ {
    /// The strength of the drag per unit of action.
    pub c: f64,
}

impl Default for QuadraticInZ {
    fn default() -> Self {
        QuadraticInZ { c: 0.1 }
    }
}

impl QuadraticInZ {
    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        &self,
        [c]: [C; 1],
        _t: T,
        q: &SVector<T, 1>,
        v: &SVector<T, 1>,
        z: T,
    ) -> T {
        (v[0] * v[0] - q[0] * q[0] - z * z * c) * 0.5
    }
}

impl Lagrangian<1> for QuadraticInZ {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        self.formula([self.c], t, q, v, z)
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, _t: T, x: &VelocityPoint<1, T>) -> Option<ChartVector<1, T>> {
        Some(ChartVector { x: -x.q, y: x.v, z: x.z * -self.c })
    }

    fn structure(&self) -> Structure {
        let without_drag = self.c == 0.0;
        Structure {
            autonomous: true,
            z_free: without_drag,
            z_affine: without_drag,
            separable: true,
            quadratic: without_drag,
            constant_mass: true,
            ..Structure::default()
        }
    }
}

parametric_fields!([] QuadraticInZ, 1, c);

impl System<1> for QuadraticInZ {
    fn name(&self) -> &'static str {
        "quadratic_in_z"
    }

    fn initial(&self) -> VelocityPoint<1> {
        VelocityPoint::new([1.0], [1.0], 1.0)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<1>) {
        let x = VelocityPoint::new([between(-2.0, 2.0, u[0])], [between(-2.0, 2.0, u[1])], between(-2.0, 2.0, u[2]));
        (between(0.0, 5.0, u[3]), x)
    }

    fn hamiltonian<T: Scalar>(&self, _t: T, x: &PhasePoint<1, T>) -> Option<T> {
        Some((x.p[0] * x.p[0] + x.q[0] * x.q[0] + x.z * x.z * self.c) * 0.5)
    }
}
