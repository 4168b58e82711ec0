//! The systems of these tests beside the catalogue.

use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Parametric, Scalar};

/// A linear oscillator with the frequency omega: `L = v^2/2 - omega^2 q^2/2 + gamma z`.
#[derive(Clone, Copy, Debug)]
pub struct Oscillator {
    pub omega: f64,
    pub gamma: f64,
}

impl Oscillator {
    fn formula<T: Scalar>([omega, gamma]: [T; 2], q: T, v: T, z: T) -> T {
        (v * v - omega * omega * q * q) * 0.5 + gamma * z
    }
}

impl Lagrangian<1> for Oscillator {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        Self::formula([self.omega, self.gamma].map(T::from), q[0], v[0], z)
    }
}

impl Parametric<1> for Oscillator {
    fn parameter_names(&self) -> Vec<String> {
        ["omega", "gamma"].map(String::from).into()
    }
    fn parameters(&self) -> Vec<f64> {
        vec![self.omega, self.gamma]
    }
    fn parameter_count(&self) -> usize {
        2
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let [omega, gamma] = *theta else { return None };
        Some(Oscillator { omega, gamma })
    }
    fn value_at<T: Scalar>(&self, theta: &[T], _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        Self::formula([theta[0], theta[1]], q[0], v[0], z)
    }
}

/// A Lagrangian whose second derivatives have all terms: it depends on the time, with a mass that depends on position,
/// velocity and a parameter, and with terms of second order in z.
#[derive(Clone, Copy, Debug)]
pub struct General {
    pub m: f64,
    pub k: f64,
}

impl General {
    fn formula<T: Scalar>([m, k]: [T; 2], t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let square = v[0] * v[0] + v[0] * v[1] * 0.3 + v[1] * v[1];
        let mass = m * (q[0].sin() * q[1] * 0.2 + 1.0);
        mass * (square * 0.5 + square * square * 0.04) + k * (q[0] - q[1] + t * 0.4).cos() - q[1] * q[1] * 0.5
            + z * (k * z * -0.1 - 0.2 + v[0] * q[1] * 0.1)
    }
}

impl Lagrangian<2> for General {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        Self::formula([self.m, self.k].map(T::from), t, q, v, z)
    }
}

impl Parametric<2> for General {
    fn parameter_names(&self) -> Vec<String> {
        ["m", "k"].map(String::from).into()
    }
    fn parameters(&self) -> Vec<f64> {
        vec![self.m, self.k]
    }
    fn parameter_count(&self) -> usize {
        2
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let [m, k] = *theta else { return None };
        Some(General { m, k })
    }
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        Self::formula([theta[0], theta[1]], t, q, v, z)
    }
}
