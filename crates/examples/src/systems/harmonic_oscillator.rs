//! The damped harmonic oscillator: the paper's second example.

use super::closed_form::{relative_exp_m1, relative_sin};
use super::{System, between, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::statements::ClosedFlow;
use contact_geom::{ChartVector, Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint};

/// The harmonic oscillator with linear drag, `L = v^2/2 - q^2/2 + gamma z`. Dimensionless: time in units of the inverse
/// frequency of the undamped oscillator.
///
/// Herglotz' equation is `q'' = -q + gamma q'`; linear, W = 1. It is underdamped for `|gamma| < 2`, critically damped
/// at 2 and overdamped beyond; [`solution`](Self::solution) covers all three cases. The energy
/// `v^2/2 + q^2/2 - gamma z` decays as `e^(gamma t)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HarmonicOscillator {
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl Default for HarmonicOscillator {
    fn default() -> Self {
        HarmonicOscillator { gamma: -0.1 }
    }
}

impl HarmonicOscillator {
    /// The entries `(a, b, s)` of the propagator: `q = a q0 + s v0`, `v = b v0 - s q0` after time `t`.
    ///
    /// Below the critical drag, with `d = 1 - gamma^2/4` and `w = sqrt d`: `s = e^(gamma t/2) sin(w t)/w`. Above it,
    /// with the exponents `fast` and `slow`, `fast slow = 1`: `s = (e^(fast t) - e^(slow t)) / (fast - slow)`.
    fn propagator(&self, t: f64) -> (f64, f64, f64) {
        let half = self.gamma * 0.5;
        // Rounded once, so that no digits are lost near critical drag or near zero drag.
        let d = (-half).mul_add(half, 1.0);
        if d > 0.0 {
            let (growth, angle) = ((half * t).exp(), d.sqrt() * t);
            let (c, s) = (angle.cos(), t * relative_sin(angle));
            (growth * (c - half * s), growth * (c + half * s), growth * s)
        } else {
            let sigma = (-d).sqrt();
            let fast = half + sigma.copysign(half);
            let slow = fast.recip();
            let (e_fast, e_slow) = ((fast * t).exp(), (slow * t).exp());
            // The larger exponential is factored out, so that nothing overflows unless the result does.
            let s = t * e_fast.max(e_slow) * relative_exp_m1(-2.0 * sigma * t.abs());
            (e_slow - slow * s, e_fast + slow * s, s)
        }
    }

    /// The motion after time `t` from any start, for every `gamma` and either sign of `t`, to a few units of round-off
    /// times `1 + |gamma t| + |t|` (the phase and the exponents are rounded).
    ///
    /// For the action: `w = z - q v/2` obeys `w' = gamma w`, and the difference of `q v` and `e^(gamma t) q0 v0` is
    /// `s (v v0 - q q0)` with the propagator's entry `s`, so no digit is lost for small `gamma` or small `t`.
    pub fn solution<T: Scalar>(&self, t: f64, start: &VelocityPoint<1, T>) -> VelocityPoint<1, T> {
        let (q0, v0) = (start.q[0], start.v[0]);
        let (a, b, s) = self.propagator(t);
        let (q, v) = (q0 * a + v0 * s, v0 * b - q0 * s);
        VelocityPoint::new([q], [v], start.z * (self.gamma * t).exp() + (v * v0 - q * q0) * (0.5 * s))
    }

    /// The initial velocity of the motion from `q0` to `q1` in time `h`; `None` where there is none or it is not
    /// unique: at `h = 0` and at the conjugate points `sin(w h) = 0`, `w = sqrt(1 - gamma^2/4)`, to within the rounding
    /// of `w h`.
    pub fn velocity_through(&self, q0: f64, q1: f64, h: f64) -> Option<f64> {
        let (a, _, s) = self.propagator(h);
        // sin(w h) / (w h); four units cover the roundings of w and of h.
        let spread = s / (h * (self.gamma * h * 0.5).exp());
        (spread.abs() > 4.0 * f64::EPSILON).then(|| (q1 - a * q0) / s).filter(|v| v.is_finite())
    }

    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        &self,
        [gamma]: [C; 1],
        _t: T,
        q: &SVector<T, 1>,
        v: &SVector<T, 1>,
        z: T,
    ) -> T {
        (v[0] * v[0] - q[0] * q[0]) * 0.5 + z * gamma
    }
}

impl Lagrangian<1> for HarmonicOscillator {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        self.formula([self.gamma], t, q, v, z)
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, _t: T, x: &VelocityPoint<1, T>) -> Option<ChartVector<1, T>> {
        Some(ChartVector { x: -x.q, y: x.v, z: T::from(self.gamma) })
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

parametric_fields!([] HarmonicOscillator, 1, gamma);

impl System<1> for HarmonicOscillator {
    fn name(&self) -> &'static str {
        "harmonic_oscillator"
    }

    fn initial(&self) -> VelocityPoint<1> {
        VelocityPoint::new([1.0], [0.0], 0.0)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<1>) {
        let x = VelocityPoint::new([between(-3.0, 3.0, u[0])], [between(-2.0, 2.0, u[1])], between(-1.0, 1.0, u[2]));
        (between(0.0, 5.0, u[3]), x)
    }

    fn hamiltonian<T: Scalar>(&self, _t: T, x: &PhasePoint<1, T>) -> Option<T> {
        Some((x.p[0] * x.p[0] + x.q[0] * x.q[0]) * 0.5 - x.z * self.gamma)
    }
}

impl ClosedFlow for HarmonicOscillator {
    fn name(&self) -> &'static str {
        System::name(self)
    }
    fn flow<T: Scalar>(&self, t: f64, x: &ChartVector<1, T>) -> ChartVector<1, T> {
        self.solution(t, &(*x).into()).into()
    }
    fn hamiltonian<T: Scalar>(&self, x: &ChartVector<1, T>) -> T {
        x.y[0] * x.y[0] * 0.5 + x.x[0] * x.x[0] * 0.5 - x.z * self.gamma
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GAMMAS: [f64; 12] = [-40.0, -2.5, -2.0 - 1e-12, -2.0, -2.0 + 1e-12, -1.999, -1e-9, 0.0, 1e-15, 0.3, 2.0, 2.5];
    const EPS: f64 = f64::EPSILON;

    /// The Taylor series of the Herglotz equations themselves, 40 terms: at `|gamma t| <= 2` exact to round-off.
    fn taylor(gamma: f64, t: f64, start: &VelocityPoint<1>) -> VelocityPoint<1> {
        let (mut q, mut v, mut z) = (vec![start.q[0]], vec![start.v[0]], vec![start.z]);
        for k in 0..40 {
            let kinetic: f64 = (0..=k).map(|i| (v[i] * v[k - i] - q[i] * q[k - i]) * 0.5).sum();
            let next = (k + 1) as f64;
            z.push((kinetic + gamma * z[k]) / next);
            q.push(v[k] / next);
            v.push((gamma * v[k] - q[k]) / next);
        }
        let at = |c: &[f64]| c.iter().rev().fold(0.0, |sum, c| sum * t + c);
        VelocityPoint::new([at(&q)], [at(&v)], at(&z))
    }

    /// Compares two points relative to their size, and z, which is quadratic in q and v, relative to the square of it.
    fn assert_close(x: &VelocityPoint<1>, y: &VelocityPoint<1>, scale: f64, units: f64, what: &str) {
        let size = scale.max(x.q[0].abs()).max(x.v[0].abs());
        for (a, b, size) in [(x.q[0], y.q[0], size), (x.v[0], y.v[0], size), (x.z, y.z, x.z.abs().max(size * size))] {
            assert!((a - b).abs() <= units * EPS * size, "{what}: {a} and {b}");
        }
    }

    #[test]
    fn the_closed_form_is_the_series_of_the_equations() {
        for [q, v, z] in [[1.0, 0.0, 0.0], [0.3, 1.7, -0.4], [-1.0, 0.5, 2.0]] {
            let start = VelocityPoint::new([q], [v], z);
            for gamma in GAMMAS {
                for t in [-0.8, -1e-3, 1e-8, 1e-3, 0.1, 0.8].map(|t| if gamma < -2.5 { t * 0.05 } else { t }) {
                    // Both have some ten roundings in sums whose terms are at most e^2 times the result's scale.
                    let (x, what) = (HarmonicOscillator { gamma }.solution(t, &start), format!("{gamma}, {t}"));
                    assert_close(&x, &taylor(gamma, t, &start), 1.0, 32.0, &what);
                }
            }
        }
    }

    #[test]
    fn the_increment_of_the_action_keeps_its_digits_in_a_short_time() {
        let start = VelocityPoint::new([0.3], [1.7], 0.0);
        for (gamma, t) in GAMMAS.into_iter().flat_map(|gamma| [1e-8, 1e-5, 1e-3].map(|t| (gamma, t))) {
            let (a, b) = (HarmonicOscillator { gamma }.solution(t, &start).z, taylor(gamma, t, &start).z);
            assert!((a - b).abs() <= 8.0 * EPS * b.abs(), "gamma = {gamma}, t = {t}: {a} and {b}");
        }
    }

    #[test]
    fn motions_compose_and_the_energy_decays_at_the_rate_gamma() {
        let start = VelocityPoint::new([0.3], [1.7], 0.4);
        for gamma in GAMMAS {
            let (system, t1, t2) = (HarmonicOscillator { gamma }, 1.75, 8.5);
            let energy = |x: &VelocityPoint<1>| (x.v[0] * x.v[0] + x.q[0] * x.q[0]) * 0.5 - gamma * x.z;
            let once = system.solution(t1 + t2, &start);
            let twice = system.solution(t2, &system.solution(t1, &start));
            // The rounding of the exponents contributes at most `|gamma t|` units, several times.
            let units = 32.0 + 8.0 * gamma.abs() * (t1 + t2);
            assert_close(&once, &twice, 0.0, units, &format!("gamma = {gamma}"));
            let size = once.q[0] * once.q[0] + once.v[0] * once.v[0] + (gamma * once.z).abs();
            let expected = energy(&start) * (gamma * (t1 + t2)).exp();
            assert!((energy(&once) - expected).abs() <= units * EPS * size, "energy at gamma = {gamma}");
        }
    }

    #[test]
    fn the_velocity_through_two_points_is_the_one_that_starts_the_motion() {
        let start = VelocityPoint::new([0.3], [1.7], 0.0);
        for (gamma, h) in GAMMAS.into_iter().flat_map(|gamma| [1e-3, 0.1, 0.5, 2.0, 4.0].map(|h| (gamma, h))) {
            let system = HarmonicOscillator { gamma };
            let (end, (a, _, s)) = (system.solution(h, &start).q[0], system.propagator(h));
            // The condition number of the problem: the sensitivity of the velocity to a rounding of the two positions.
            let condition = 1.0 + ((a * 0.3).abs() + end.abs()) / s.abs();
            let Some(v) = system.velocity_through(0.3, end, h) else { unreachable!("{h} is not conjugate") };
            assert!((v - 1.7).abs() <= 16.0 * EPS * condition, "gamma = {gamma}, h = {h}: {v}");
            assert_eq!(system.velocity_through(0.3, 0.3, 0.0), None);
        }
    }

    #[test]
    fn conjugate_points_have_no_velocity() {
        for (gamma, k) in [-1.999, -0.7, 0.0, 0.3].into_iter().flat_map(|g| (1..20).map(move |k| (g, f64::from(k)))) {
            let (system, half) = (HarmonicOscillator { gamma }, gamma * 0.5_f64);
            let h = k * std::f64::consts::PI / ((1.0 - half) * (1.0 + half)).sqrt();
            assert_eq!(system.velocity_through(0.3, 1.0, h), None, "gamma = {gamma}, k = {k}");
        }
    }
}
