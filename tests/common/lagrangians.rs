//! Lagrangians that several test files share and that are no systems of the catalogue.

use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Lagrangian, Scalar, Structure, VelocityPoint};

/// A Lagrangian with another structure than it declares itself, and without closed derivatives.
#[derive(Clone, Copy, Debug)]
pub struct WithStructure<L>(pub L, pub Structure);

impl<const N: usize, L: Lagrangian<N>> Lagrangian<N> for WithStructure<L> {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.0.value(t, q, v, z)
    }
    fn structure(&self) -> Structure {
        self.1
    }
}

/// A Lagrangian with another structure than it declares itself, and with its closed gradient, whose rounding is part of
/// the test.
#[derive(Clone, Copy, Debug)]
pub struct WithGradientAndStructure<L>(pub L, pub Structure);

impl<L: Lagrangian<N>, const N: usize> Lagrangian<N> for WithGradientAndStructure<L> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.0.value(t, q, v, z)
    }
    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> Option<ChartVector<N, T>> {
        self.0.closed_gradient(t, x)
    }
    fn structure(&self) -> Structure {
        self.1
    }
}

/// Bratu's problem `q'' = -lambda e^q` with linear drag: without drag two solutions with `q(0) = q(1) = 0` for
/// `lambda < 3.513830719`, and none for larger lambda.
#[derive(Clone, Copy, Debug)]
pub struct Bratu {
    pub lambda: f64,
    pub drag: f64,
}

impl Bratu {
    /// Without drag.
    pub fn undamped(lambda: f64) -> Self {
        Bratu { lambda, drag: 0.0 }
    }

    /// The undamped solution with `q(0) = q(1) = 0` has the maximum `2 ln cosh(a / 2)`, where `2 a^2 = lambda cosh^2(a
    /// / 2)`: the maximum and `a`, for the root `a` in a bracket.
    pub fn maximum(lambda: f64, [mut low, mut high]: [f64; 2]) -> (f64, f64) {
        let off = |a: f64| 2.0 * a * a - lambda * (0.5 * a).cosh().powi(2);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if (off(middle) > 0.0) == (off(low) > 0.0) { low = middle } else { high = middle }
        }
        (2.0 * (0.5 * low).cosh().ln(), low)
    }
}

impl Lagrangian<1> for Bratu {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 - q[0].exp() * self.lambda - z * self.drag
    }
}

/// `L = v^2/2 + z^2`: on a motion at rest `z' = z^2`, which from z = 1 is infinite at t = 1.
pub struct Explosive;

impl Lagrangian<1> for Explosive {
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + z * z
    }
}

/// A potential `-ln q / 1000`, which is defined for q > 0, with linear drag.
pub struct LogarithmicWall;

impl Lagrangian<1> for LogarithmicWall {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + q[0].ln() * 1e-3 - z * 0.1
    }
}

/// A Lagrangian linear in the velocity: `W = L_vv` is zero.
pub struct Massless;

impl Lagrangian<1> for Massless {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * q[0] + z
    }
}
