//! Duffing's oscillator, free and forced.

use super::{System, between, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{ChartVector, Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint};

/// Duffing's oscillator, `L = v^2/2 - alpha q^2/2 - beta q^4/4 + force cos(omega t) q + gamma z`. Dimensionless:
/// lengths and times in which mass and, by default, both spring constants have absolute value one.
///
/// Herglotz' equation is `q'' = -alpha q - beta q^3 + force cos(omega t) + gamma q'`; nonlinear, W = 1. For
/// `alpha < 0 < beta` there are two wells, `q = +-sqrt(-alpha/beta)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Duffing {
    /// The linear spring constant; negative for a double well.
    pub alpha: f64,
    /// The cubic spring constant.
    pub beta: f64,
    /// The amplitude of the forcing.
    pub force: f64,
    /// The angular frequency of the forcing.
    pub omega: f64,
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl Default for Duffing {
    /// The unforced double well.
    fn default() -> Self {
        Duffing { alpha: -1.0, beta: 1.0, force: 0.0, omega: 0.0, gamma: -0.25 }
    }
}

impl Duffing {
    /// The double well with periodic forcing.
    pub fn forced() -> Self {
        Duffing { force: 0.3, omega: 1.2, ..Duffing::default() }
    }

    /// The potential with the forcing: `V(t, q)`.
    #[inline(always)]
    fn potential<C: Coefficient, T: ScalarOver<C>>([alpha, beta, force, omega]: [C; 4], t: T, q: T) -> T {
        let square = q * q;
        square * (square * (beta * 0.25) + alpha * 0.5) - (t * omega).cos() * q * force
    }

    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        &self,
        [alpha, beta, force, omega, gamma]: [C; 5],
        t: T,
        q: &SVector<T, 1>,
        v: &SVector<T, 1>,
        z: T,
    ) -> T {
        v[0] * v[0] * 0.5 - Self::potential([alpha, beta, force, omega], t, q[0]) + z * gamma
    }
}

impl Lagrangian<1> for Duffing {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        self.formula([self.alpha, self.beta, self.force, self.omega, self.gamma], t, q, v, z)
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<1, T>) -> Option<ChartVector<1, T>> {
        let q = x.q[0];
        let force = (t * self.omega).cos() * self.force - q * (q * q * self.beta + self.alpha);
        Some(ChartVector { x: SVector::from([force]), y: x.v, z: T::from(self.gamma) })
    }

    fn structure(&self) -> Structure {
        Structure {
            autonomous: self.force == 0.0 || self.omega == 0.0,
            z_free: self.gamma == 0.0,
            z_affine: true,
            constant_rate: true,
            separable: true,
            quadratic: self.beta == 0.0,
            constant_mass: true,
        }
    }
}

parametric_fields!([] Duffing, 1, alpha, beta, force, omega, gamma);

impl System<1> for Duffing {
    fn name(&self) -> &'static str {
        if self.force == 0.0 { "duffing" } else { "duffing_forced" }
    }

    fn initial(&self) -> VelocityPoint<1> {
        VelocityPoint::new([1.5], [0.0], 0.0)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<1>) {
        let x = VelocityPoint::new([between(-2.0, 2.0, u[0])], [between(-2.0, 2.0, u[1])], between(-1.0, 1.0, u[2]));
        (between(0.0, 6.0, u[3]), x)
    }

    fn hamiltonian<T: Scalar>(&self, t: T, x: &PhasePoint<1, T>) -> Option<T> {
        let potential = Self::potential([self.alpha, self.beta, self.force, self.omega], t, x.q[0]);
        Some(x.p[0] * x.p[0] * 0.5 + potential - x.z * self.gamma)
    }
}
