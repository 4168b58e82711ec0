//! Bregman dynamics: accelerated optimization as a contact Hamiltonian system.

use super::Objective;
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar};

/// The kinetic energy K of [`Bregman`], the convex conjugate of its distance function h.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kinetic {
    /// `K = |p|^2/2`, `h = |y|^2/2`.
    Quadratic,
    /// `K = c sqrt(|p|^2 + m^2 c^2)`, `h = -m c sqrt(c^2 - |y|^2)`, for minima with `|q| < c`.
    Relativistic {
        /// The largest speed c.
        speed: f64,
        /// The mass m.
        mass: f64,
    },
}

impl Kinetic {
    /// The kinetic energy.
    #[inline(always)]
    pub fn energy<T: Scalar, const N: usize>(&self, p: &SVector<T, N>) -> T {
        match self {
            Kinetic::Quadratic => dot(p, p) * 0.5,
            Kinetic::Relativistic { speed, mass } => (dot(p, p) + (mass * speed).powi(2)).sqrt() * *speed,
        }
    }

    /// The momentum `grad h(y)`, for which `grad K(p) = y`; NaN for a relativistic y that is not shorter than the speed.
    pub fn momentum<const N: usize>(&self, y: &SVector<f64, N>) -> SVector<f64, N> {
        match self {
            Kinetic::Quadratic => *y,
            Kinetic::Relativistic { speed, mass } => y * (mass * speed / (speed * speed - y.norm_squared()).sqrt()),
        }
    }

    /// The distance function `h(y)`; NaN for a relativistic y that is longer than the speed.
    pub fn distance<const N: usize>(&self, y: &SVector<f64, N>) -> f64 {
        match self {
            Kinetic::Quadratic => y.norm_squared() * 0.5,
            Kinetic::Relativistic { speed, mass } => -mass * speed * (speed * speed - y.norm_squared()).sqrt(),
        }
    }
}

/// The polynomial Bregman dynamics of an objective f as a contact Hamiltonian system, linear in z with a drag that
/// depends on time: `H = (k/t) (K(p) - p . q + C t^k f(q) + z)` for `t > 0`.
///
/// `q' = (k/t) (grad K(p) - q)`, `p' = -(k/t) C t^k grad f(q)`: with the conjugate h of K this is
/// `d/dt grad h(q + (t/k) q') = -C k t^(k-1) grad f(q)`, and for the quadratic K it is
/// `q'' + ((k + 1)/t) q' + C k^2 t^(k-2) grad f(q) = 0`, the limit of Nesterov's method for `k = 2`. The conformal factor
/// from t to r is `(t/r)^k`. For a convex f with the minimum f* at q*, the function
/// `h(q*) + K(p) - p . q* + C t^k (f(q) - f*)` does not increase, so that `f(q) - f*` decreases like `t^-k`. Wibisono, Wilson
/// and Jordan, "A variational perspective on accelerated methods in optimization", PNAS 113 (2016); in these coordinates
/// Bravetti, Daza-Torres, Flores-Arguedas and Betancourt, "Bregman dynamics, contact transformations and convex
/// optimization", Information Geometry 6 (2023).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bregman<F> {
    /// The objective f.
    pub objective: F,
    /// The kinetic energy K.
    pub kinetic: Kinetic,
    /// The power k of the convergence.
    pub power: u8,
    /// The factor C of the objective.
    pub scale: f64,
}

impl<F> Bregman<F> {
    /// The start of a motion at rest: `p = grad h(q)`.
    pub fn start<const N: usize>(&self, q: SVector<f64, N>) -> PhasePoint<N> {
        PhasePoint { q, p: self.kinetic.momentum(&q), z: 0.0 }
    }

    /// The function that does not increase along a motion, for a convex objective with its minimum at a point.
    pub fn lyapunov<const N: usize>(&self, t: f64, x: &PhasePoint<N>, minimum: &SVector<f64, N>) -> f64
    where
        F: Objective<N>,
    {
        let excess = self.objective.value(&x.q) - self.objective.value(minimum);
        let divergence = self.kinetic.distance(minimum) + self.kinetic.energy(&x.p) - dot(x.p, minimum);
        divergence + self.scale * t.powi(i32::from(self.power)) * excess
    }
}

impl<F: Objective<N>, const N: usize> ContactHamiltonian<N> for Bregman<F> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        let weight = t.powi(i32::from(self.power)) * self.scale;
        let energy = self.kinetic.energy(p) - dot(p, q) + self.objective.value(q) * weight + z;
        energy / t * f64::from(self.power)
    }

    fn structure(&self) -> HamiltonianStructure {
        let degree = (self.kinetic == Kinetic::Quadratic).then_some(2);
        HamiltonianStructure { z_affine: true, degree, ..HamiltonianStructure::default() }
    }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl<F: Objective<N>, const N: usize> contact_geom::ParametricHamiltonian<N> for Bregman<F> {}
