//! A damped spring, with its motion in closed form.

use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{Lagrangian, Parametric, Scalar};

/// `L = v^2/2 - k x^2/2 - c z`.
#[derive(Clone, Copy, Debug)]
pub struct Spring {
    pub k: f64,
    pub c: f64,
}

impl Spring {
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>([k, c]: [C; 2], q: T, v: T, z: T) -> T {
        v * v * 0.5 - q * q * (k * 0.5) + z * (-c)
    }

    /// The position at a time, from 1 at rest, for weak damping.
    pub fn position(&self, t: f64) -> f64 {
        let (half, w) = (0.5 * self.c, (self.k - 0.25 * self.c * self.c).sqrt());
        (-half * t).exp() * ((w * t).cos() + half / w * (w * t).sin())
    }
}

impl Lagrangian<1> for Spring {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        Self::formula([self.k, self.c], q[0], v[0], z)
    }
}

impl Parametric<1> for Spring {
    fn parameter_names(&self) -> Vec<String> {
        ["k", "c"].map(String::from).into()
    }
    fn parameters(&self) -> Vec<f64> {
        vec![self.k, self.c]
    }
    fn parameter_count(&self) -> usize {
        2
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let [k, c] = *theta else { return None };
        Some(Spring { k, c })
    }
    #[inline(always)]
    fn value_at<T: Scalar>(&self, theta: &[T], _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        Self::formula([theta[0], theta[1]], q[0], v[0], z)
    }
}

/// `L = m v^2/2 - k x^2/2`.
#[derive(Clone, Copy, Debug)]
pub struct Heavy {
    pub m: f64,
    pub k: f64,
}

impl Lagrangian<1> for Heavy {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * (self.m * 0.5) - q[0] * q[0] * (self.k * 0.5)
    }
}

impl Parametric<1> for Heavy {
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
        Some(Heavy { m, k })
    }
    #[inline(always)]
    fn value_at<T: Scalar>(&self, theta: &[T], _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * theta[0] * 0.5 - q[0] * q[0] * theta[1] * 0.5
    }
}
