//! Kepler's problem with dissipation that is periodic in time.

use super::kepler::{attraction, pericentre, sample_annulus};
use super::{System, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{Lagrangian, PhasePoint, Scalar, Structure, Symmetry, VelocityPoint};

/// Kepler's problem in the plane with a drag that changes sign periodically,
/// `L = |v|^2/2 + mu/|q| + alpha sin(theta t) z`. Dimensionless, like [`Kepler`](super::Kepler).
///
/// Herglotz' equation is `q'' = -mu q/|q|^3 + alpha sin(theta t) q'`; nonlinear, singular at `q = 0`, W the identity.
/// The conformal factor `exp(alpha (1 - cos(theta t)) / theta)` from `t = 0` depends on time alone and returns to one
/// periodically, so that there is no dissipation on average. The system is one of the family
/// `q'' + grad V + f(t) q' = 0` of Bravetti, Seri, Vermeeren and Zadra, "Numerical integration in celestial mechanics:
/// a case for contact geometry", Celest. Mech. Dyn. Astron. 132 (2020).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PerturbedKepler {
    /// The gravitational parameter: the gravitational constant times the mass of the centre.
    pub mu: f64,
    /// The amplitude of the rate `L_z` of the conformal factor.
    pub alpha: f64,
    /// The angular frequency of the rate.
    pub theta: f64,
}

impl Default for PerturbedKepler {
    fn default() -> Self {
        PerturbedKepler { mu: 1.0, alpha: 0.01, theta: std::f64::consts::PI }
    }
}

impl PerturbedKepler {
    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        &self,
        [mu, alpha, theta]: [C; 3],
        t: T,
        q: &SVector<T, 2>,
        v: &SVector<T, 2>,
        z: T,
    ) -> T {
        dot(v, v) * 0.5 + attraction(mu, q) + (t * theta).sin() * z * alpha
    }
}

impl Lagrangian<2> for PerturbedKepler {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        self.formula([self.mu, self.alpha, self.theta], t, q, v, z)
    }

    fn structure(&self) -> Structure {
        let without_drag = self.alpha == 0.0 || self.theta == 0.0;
        Structure {
            autonomous: without_drag,
            z_free: without_drag,
            z_affine: true,
            separable: true,
            constant_mass: true,
            ..Structure::default()
        }
    }
}

parametric_fields!([] PerturbedKepler, 2, mu, alpha, theta);

impl System<2> for PerturbedKepler {
    fn name(&self) -> &'static str {
        "perturbed_kepler"
    }

    fn initial(&self) -> VelocityPoint<2> {
        pericentre(self.mu)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<2>) {
        sample_annulus(u)
    }

    fn hamiltonian<T: Scalar>(&self, t: T, x: &PhasePoint<2, T>) -> Option<T> {
        Some(dot(x.p, x.p) * 0.5 - attraction(self.mu, &x.q) - (t * self.theta).sin() * x.z * self.alpha)
    }

    fn symmetries(&self) -> Vec<Symmetry<2>> {
        vec![Symmetry::Rotation(0, 1)]
    }
}
