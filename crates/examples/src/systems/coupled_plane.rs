//! A system with two degrees of freedom in which positions, velocities and action are all coupled.

use super::{System, between, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint};

/// An anisotropic oscillator in the plane whose inertia depends on position and action, with a magnetic term that grows
/// with the action and a drag that is quadratic in it, for `|a| < 1`:
/// `L = ((1 + a cos x) v_x^2 + (1 + a sin y cos z) v_y^2)/2 + b z (x v_y - y v_x) -
/// (x^2 + 2 y^2)/2 - x^2 y/3 - c z^2/2`.
///
/// Dimensionless: mass one, time in units of the inverse frequency along x.
///
/// Herglotz' equations are those of this L. No block of second derivatives in `(q, v, z)` is constant, and W is
/// diagonal with entries of at least `1 - |a|`. The system tests formulas in more than one dimension and with `L_qz`,
/// `L_vz` and `W_z` all different from zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoupledPlane {
    /// The strength of the dependence of the inertia on position and action; below one in absolute value.
    pub a: f64,
    /// The strength of the magnetic term, in inverse units of action.
    pub b: f64,
    /// The coefficient of the drag.
    pub c: f64,
}

impl Default for CoupledPlane {
    fn default() -> Self {
        CoupledPlane { a: 0.3, b: 0.4, c: 0.3 }
    }
}

impl CoupledPlane {
    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        &self,
        [a, b, c]: [C; 3],
        _t: T,
        q: &SVector<T, 2>,
        v: &SVector<T, 2>,
        z: T,
    ) -> T {
        let (x, y) = (q[0], q[1]);
        let kinetic = v[0] * v[0] * (x.cos() * a + 1.0) + v[1] * v[1] * (y.sin() * z.cos() * a + 1.0);
        let magnetic = z * (x * v[1] - y * v[0]) * b;
        kinetic * 0.5 + magnetic - (x * x * 0.5 + y * y) - x * x * y / 3.0 - z * z * (c * 0.5)
    }
}

impl Lagrangian<2> for CoupledPlane {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        self.formula([self.a, self.b, self.c], t, q, v, z)
    }

    fn structure(&self) -> Structure {
        Structure { autonomous: true, ..Structure::default() }
    }
}

parametric_fields!([] CoupledPlane, 2, a, b, c);

impl System<2> for CoupledPlane {
    fn name(&self) -> &'static str {
        "coupled_plane"
    }

    fn initial(&self) -> VelocityPoint<2> {
        VelocityPoint::new([1.0, 0.2], [0.3, 0.8], 0.4)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<2>) {
        let q = [between(-1.5, 1.5, u[0]), between(-1.5, 1.5, u[1])];
        let v = [between(-1.5, 1.5, u[2]), between(-1.5, 1.5, u[3])];
        (between(0.0, 5.0, u[5]), VelocityPoint::new(q, v, between(-1.0, 1.0, u[4])))
    }
}
