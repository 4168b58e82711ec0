//! The damped double pendulum.

use super::{System, between};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::support::indexed_names;
use contact_geom::{Lagrangian, Parametric, PhasePoint, Scalar, Structure, VelocityPoint};

/// The planar double pendulum with linear drag,
/// `L = (m1 + m2) l1^2 v1^2/2 + m2 l2^2 v2^2/2 + m2 l1 l2 cos(q1 - q2) v1 v2 - V(q) + gamma z` with
/// `V = (m1 + m2) l1 (1 - cos q1) + m2 l2 (1 - cos q2)`, both angles from the downward vertical. Dimensionless:
/// `g = 1`.
///
/// Herglotz' equations are `(W q')' = L_q + gamma W q'`, so the drag acts on the momenta; nonlinear and chaotic at
/// large energy. W depends on `q1 - q2`, with determinant `m2 l1^2 l2^2 (m1 + m2 sin^2(q1 - q2)) > 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoublePendulum {
    /// The masses of the upper and of the lower bob.
    pub masses: [f64; 2],
    /// The lengths of the upper and of the lower rod.
    pub lengths: [f64; 2],
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl Default for DoublePendulum {
    fn default() -> Self {
        DoublePendulum { masses: [1.0, 1.0], lengths: [1.0, 1.0], gamma: -0.1 }
    }
}

impl DoublePendulum {
    /// The constants of W: its two diagonal entries, and the factor of `cos(q1 - q2)` off the diagonal.
    #[inline(always)]
    fn inertia<C: Coefficient>([m1, m2]: [C; 2], [l1, l2]: [C; 2]) -> (C, C, C) {
        ((m1 + m2) * l1 * l1, m2 * l2 * l2, m2 * l1 * l2)
    }

    /// The potential energy, zero where both rods hang down.
    #[inline(always)]
    fn potential<C: Coefficient, T: ScalarOver<C>>([m1, m2]: [C; 2], [l1, l2]: [C; 2], q: &SVector<T, 2>) -> T {
        q[0].versine() * ((m1 + m2) * l1) + q[1].versine() * (m2 * l2)
    }

    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        masses: [C; 2],
        lengths: [C; 2],
        gamma: C,
        q: &SVector<T, 2>,
        v: &SVector<T, 2>,
        z: T,
    ) -> T {
        let (upper, lower, mixed) = Self::inertia(masses, lengths);
        let turning = v[0] * v[0] * (upper * 0.5) + v[1] * v[1] * (lower * 0.5);
        turning + (q[0] - q[1]).cos() * v[0] * v[1] * mixed - Self::potential(masses, lengths, q) + z * gamma
    }
}

impl Lagrangian<2> for DoublePendulum {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        Self::formula(self.masses, self.lengths, self.gamma, q, v, z)
    }

    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: self.gamma == 0.0, z_affine: true, ..Structure::default() }
    }
}

impl Parametric<2> for DoublePendulum {
    fn parameter_names(&self) -> Vec<String> {
        indexed_names("masses", 2).chain(indexed_names("lengths", 2)).chain(["gamma".to_owned()]).collect()
    }
    fn parameters(&self) -> Vec<f64> {
        self.masses.into_iter().chain(self.lengths).chain([self.gamma]).collect()
    }
    #[inline(always)]
    fn parameter_count(&self) -> usize {
        5
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let [m1, m2, l1, l2, gamma] = *theta else { return None };
        Some(DoublePendulum { masses: [m1, m2], lengths: [l1, l2], gamma })
    }
    #[inline(always)]
    fn value_at<T: Scalar>(&self, theta: &[T], _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let [m1, m2, l1, l2, gamma] = *theta else { return T::from(f64::NAN) };
        Self::formula([m1, m2], [l1, l2], gamma, q, v, z)
    }
}

impl System<2> for DoublePendulum {
    fn name(&self) -> &'static str {
        "double_pendulum"
    }

    fn initial(&self) -> VelocityPoint<2> {
        VelocityPoint::new([1.5, 2.0], [0.0, 0.0], 0.0)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<2>) {
        let q = [between(-3.0, 3.0, u[0]), between(-3.0, 3.0, u[1])];
        let v = [between(-2.0, 2.0, u[2]), between(-2.0, 2.0, u[3])];
        (between(0.0, 5.0, u[5]), VelocityPoint::new(q, v, between(-1.0, 1.0, u[4])))
    }

    fn hamiltonian<T: Scalar>(&self, _t: T, x: &PhasePoint<2, T>) -> Option<T> {
        let ([m1, m2], (upper, lower, mixed)) = (self.masses, Self::inertia(self.masses, self.lengths));
        let (sin, cos) = (x.q[0] - x.q[1]).sin_cos();
        let determinant = (sin * sin * m2 + m1) * (self.lengths[0] * self.lengths[0] * lower);
        let (p1, p2) = (x.p[0], x.p[1]);
        let kinetic = (p1 * p1 * lower - cos * p1 * p2 * (2.0 * mixed) + p2 * p2 * upper) / determinant * 0.5;
        Some(kinetic + Self::potential(self.masses, self.lengths, &x.q) - x.z * self.gamma)
    }
}
