//! A charged particle in a trap with a uniform magnetic field.

use super::{System, between, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{Lagrangian, PhasePoint, Scalar, Structure, Symmetry, VelocityPoint};

/// A charged particle in the plane, in a uniform magnetic field and a harmonic trap, with drag:
/// `L = |v|^2/2 + (b/2) (x v_y - y v_x) - k |q|^2/2 + gamma z`, `q = (x, y)`. Dimensionless: mass and charge one, b the
/// cyclotron frequency.
///
/// Herglotz' equations are `x'' = b y' - k x + gamma (x' - b y/2)`, `y'' = -b x' - k y + gamma (y' + b x/2)`; linear, W
/// the identity, but L is not kinetic minus potential energy. The drag acts on the canonical momentum `p = v + A`, and
/// therefore depends on the gauge. The symmetric gauge is used here, in which rotations are symmetries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChargedParticle {
    /// The magnetic field, as a cyclotron frequency.
    pub b: f64,
    /// The spring constant of the trap.
    pub k: f64,
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl Default for ChargedParticle {
    fn default() -> Self {
        ChargedParticle { b: 1.0, k: 0.5, gamma: -0.1 }
    }
}

impl ChargedParticle {
    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        &self,
        [b, k, gamma]: [C; 3],
        _t: T,
        q: &SVector<T, 2>,
        v: &SVector<T, 2>,
        z: T,
    ) -> T {
        let swept = q[0] * v[1] - q[1] * v[0];
        dot(v, v) * 0.5 + swept * (b * 0.5) - dot(q, q) * (k * 0.5) + z * gamma
    }
}

impl Lagrangian<2> for ChargedParticle {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        self.formula([self.b, self.k, self.gamma], t, q, v, z)
    }

    fn structure(&self) -> Structure {
        Structure {
            autonomous: true,
            z_free: self.gamma == 0.0,
            z_affine: true,
            separable: self.b == 0.0,
            quadratic: true,
            constant_mass: true,
            ..Structure::default()
        }
    }
}

parametric_fields!([] ChargedParticle, 2, b, k, gamma);

impl System<2> for ChargedParticle {
    fn name(&self) -> &'static str {
        "charged_particle"
    }

    fn initial(&self) -> VelocityPoint<2> {
        VelocityPoint::new([1.0, 0.0], [0.0, 1.0], 0.0)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<2>) {
        let q = [between(-2.0, 2.0, u[0]), between(-2.0, 2.0, u[1])];
        let v = [between(-2.0, 2.0, u[2]), between(-2.0, 2.0, u[3])];
        (between(0.0, 5.0, u[5]), VelocityPoint::new(q, v, between(-1.0, 1.0, u[4])))
    }

    fn hamiltonian<T: Scalar>(&self, _t: T, x: &PhasePoint<2, T>) -> Option<T> {
        let (half, q, p) = (self.b * 0.5, &x.q, &x.p);
        let (vx, vy) = (p[0] + q[1] * half, p[1] - q[0] * half);
        Some((vx * vx + vy * vy) * 0.5 + dot(q, q) * (self.k * 0.5) - x.z * self.gamma)
    }

    fn symmetries(&self) -> Vec<Symmetry<2>> {
        vec![Symmetry::Rotation(0, 1)]
    }
}
