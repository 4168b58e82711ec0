//! Relativistic gradient descent.

use super::Objective;
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar};

/// Relativistic gradient descent with momentum: `H = c sqrt(|p|^2 + m^2 c^2) + f(q) - gamma z`, `gamma < 0`.
///
/// `q' = c p/sqrt(|p|^2 + m^2 c^2)`, `p' = -grad f(q) + gamma p`: the speed is below c however steep the objective is. It
/// is the heavy ball of mass m for large c. The energy decreases, `(H + gamma z)' = gamma p . q' <= 0`. Franca, Sulam,
/// Robinson and Vidal, "Conformal symplectic and relativistic optimization", J. Stat. Mech. (2020).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativisticDescent<F> {
    /// The objective f.
    pub objective: F,
    /// The mass m.
    pub mass: f64,
    /// The largest speed c.
    pub speed: f64,
    /// The rate of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl<F> RelativisticDescent<F> {
    /// The start of a motion at rest.
    pub fn start<const N: usize>(&self, q: SVector<f64, N>) -> PhasePoint<N> {
        PhasePoint { q, p: SVector::zeros(), z: 0.0 }
    }
}

impl<F: Objective<N>, const N: usize> ContactHamiltonian<N> for RelativisticDescent<F> {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        let kinetic = (dot(p, p) + (self.mass * self.speed).powi(2)).sqrt() * self.speed;
        kinetic + self.objective.value(q) - z * self.gamma
    }

    fn structure(&self) -> HamiltonianStructure {
        HamiltonianStructure {
            autonomous: true,
            z_free: self.gamma == 0.0,
            z_affine: true,
            constant_rate: true,
            separable: true,
            degree: None,
            homogeneous: false,
        }
    }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl<F: Objective<N>, const N: usize> contact_geom::ParametricHamiltonian<N> for RelativisticDescent<F> {}
