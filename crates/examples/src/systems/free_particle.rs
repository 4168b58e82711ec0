//! The free particle with linear drag: the paper's first example.

use super::closed_form::relative_exp_m1;
use super::{System, between, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::statements::ClosedFlow;
use contact_geom::{ChartVector, Lagrangian, PhasePoint, Scalar, Structure, Symmetry, VelocityPoint};

/// A free particle with linear drag, `L = v^2/2 + gamma z`. Dimensionless: any units of length and time in which the
/// mass is one.
///
/// Herglotz' equation is `q'' = gamma q'`; linear, W = 1. The motion is known in closed form; see
/// [`solution`](Self::solution) and [`velocity_through`](Self::velocity_through).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FreeParticle {
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl Default for FreeParticle {
    fn default() -> Self {
        FreeParticle { gamma: -0.1 }
    }
}

impl FreeParticle {
    /// The motion after time `t` from any start, for every `gamma` and either sign of `t`, to a few units of round-off
    /// times `1 + |gamma t|` (the exponent is rounded).
    ///
    /// With `s = (e^(gamma t) - 1) / gamma`: `q = q0 + s v0`, `v = e^(gamma t) v0`, `z = e^(gamma t) (z0 + s v0^2/2)`.
    pub fn solution<T: Scalar>(&self, t: f64, start: &VelocityPoint<1, T>) -> VelocityPoint<1, T> {
        let (q, v) = (start.q[0], start.v[0]);
        let (sigma, s) = ((self.gamma * t).exp(), t * relative_exp_m1(self.gamma * t));
        VelocityPoint::new([q + v * s], [v * sigma], (start.z + v * v * (0.5 * s)) * sigma)
    }

    /// The initial velocity of the motion from `q0` to `q1` in time `h`; `None` for `h = 0`, where there is none or it
    /// is not unique.
    pub fn velocity_through(&self, q0: f64, q1: f64, h: f64) -> Option<f64> {
        Some((q1 - q0) / (h * relative_exp_m1(self.gamma * h))).filter(|v| v.is_finite())
    }

    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        &self,
        [gamma]: [C; 1],
        _t: T,
        _q: &SVector<T, 1>,
        v: &SVector<T, 1>,
        z: T,
    ) -> T {
        v[0] * v[0] * 0.5 + z * gamma
    }
}

impl Lagrangian<1> for FreeParticle {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        self.formula([self.gamma], t, q, v, z)
    }

    fn structure(&self) -> Structure {
        Structure {
            autonomous: true,
            z_free: self.gamma == 0.0,
            z_affine: true,
            separable: true,
            quadratic: true,
            constant_mass: true,
            ..Structure::default()
        }
    }
}

parametric_fields!([] FreeParticle, 1, gamma);

impl System<1> for FreeParticle {
    fn name(&self) -> &'static str {
        "free_particle"
    }

    fn initial(&self) -> VelocityPoint<1> {
        VelocityPoint::new([0.0], [1.0], 0.0)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<1>) {
        let x = VelocityPoint::new([between(-3.0, 3.0, u[0])], [between(-2.0, 2.0, u[1])], between(-1.0, 1.0, u[2]));
        (between(0.0, 5.0, u[3]), x)
    }

    fn hamiltonian<T: Scalar>(&self, _t: T, x: &PhasePoint<1, T>) -> Option<T> {
        Some(x.p[0] * x.p[0] * 0.5 - x.z * self.gamma)
    }

    fn symmetries(&self) -> Vec<Symmetry<1>> {
        vec![Symmetry::Translation(SVector::from([1.0]))]
    }
}

impl ClosedFlow for FreeParticle {
    fn name(&self) -> &'static str {
        System::name(self)
    }
    fn flow<T: Scalar>(&self, t: f64, x: &ChartVector<1, T>) -> ChartVector<1, T> {
        self.solution(t, &(*x).into()).into()
    }
    fn hamiltonian<T: Scalar>(&self, x: &ChartVector<1, T>) -> T {
        x.y[0] * x.y[0] * 0.5 - x.z * self.gamma
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAMMAS: [f64; 7] = [-1e3, -2.5, -0.1, -1e-9, 0.0, 1e-15, 0.7];

    /// Each formula has fewer than 16 roundings; the exponential adds `|gamma t|` units.
    fn tolerance(gamma: f64, t: f64) -> f64 {
        (16.0 + 4.0 * (gamma * t).abs()) * f64::EPSILON
    }

    #[test]
    fn rates_at_the_start_are_herglotz_equation() {
        // Forward differences: q, v and z are analytic, so the error is h times half of the second derivative.
        let (start, h) = (VelocityPoint::new([0.3], [1.7], -0.4), 1e-7);
        for gamma in [-2.5, -0.1, -1e-9, 0.0, 0.7] {
            let system = FreeParticle { gamma };
            let x = system.solution(h, &start);
            let rates = [(x.q[0] - 0.3) / h, (x.v[0] - 1.7) / h, (x.z + 0.4) / h];
            let expected = [1.7, gamma * 1.7, system.value(0.0, &start.q, &start.v, start.z)];
            for (found, expected) in rates.iter().zip(expected) {
                assert!((found - expected).abs() <= 20.0 * h, "gamma = {gamma}: {found} for {expected}");
            }
        }
    }

    #[test]
    fn motions_compose() {
        let start = VelocityPoint::new([0.3], [1.7], 0.4);
        for gamma in GAMMAS {
            let (system, t1, t2) = (FreeParticle { gamma }, 0.75, 1.25);
            let once = system.solution(t1 + t2, &start);
            let twice = system.solution(t2, &system.solution(t1, &start));
            for (a, b) in [(once.q[0], twice.q[0]), (once.v[0], twice.v[0]), (once.z, twice.z)] {
                assert!((a - b).abs() <= tolerance(gamma, t1 + t2) * a.abs(), "gamma = {gamma}: {a} and {b}");
            }
        }
    }

    #[test]
    fn the_limit_without_drag_loses_no_digits() {
        let start = VelocityPoint::new([0.25], [1.5], 0.5);
        let (free, slow) = (FreeParticle { gamma: 0.0 }, FreeParticle { gamma: 1e-200 });
        assert_eq!(free.solution(2.0, &start), VelocityPoint::new([3.25], [1.5], 2.75));
        assert_eq!(slow.solution(2.0, &start), free.solution(2.0, &start));
    }

    #[test]
    fn the_velocity_through_two_points_is_the_one_that_starts_the_motion() {
        for gamma in GAMMAS {
            let (system, start) = (FreeParticle { gamma }, VelocityPoint::new([0.0], [1.7], 0.0));
            for h in [1e-8, 1e-3, 0.5, 2.0] {
                let Some(v) = system.velocity_through(0.0, system.solution(h, &start).q[0], h) else {
                    unreachable!("a motion exists for every h > 0")
                };
                assert!((v - 1.7).abs() <= 1.7 * tolerance(gamma, h), "gamma = {gamma}, h = {h}: {v}");
            }
            assert_eq!(system.velocity_through(0.0, 1.0, 0.0), None);
            assert_eq!(system.velocity_through(1.0, 1.0, 0.0), None);
        }
    }
}
