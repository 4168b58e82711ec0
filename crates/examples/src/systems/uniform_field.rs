//! A particle in a uniform field, with linear drag.

use super::closed_form::{relative_exp_m1, second_relative_exp, third_relative_exp};
use super::{System, between};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::support::indexed_names;
use contact_geom::{Lagrangian, Parametric, PhasePoint, Scalar, Structure, Symmetry, VelocityPoint};

/// A particle falling in a uniform field with linear drag, `L = |v|^2/2 + a . q + gamma z` in R^D. Dimensionless: any
/// units in which the mass is one; natural are those in which the field is one.
///
/// Herglotz' equation is `q'' = a + gamma q'`; linear, inhomogeneous, W the identity. The velocity tends to `-a/gamma`
/// for `gamma < 0`. Translations perpendicular to the field are symmetries. The motion is known in closed form; see
/// [`solution`](Self::solution) and [`velocity_through`](Self::velocity_through).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UniformField<const D: usize> {
    /// The field a: the acceleration of a particle at rest.
    pub field: [f64; D],
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl<const D: usize> Default for UniformField<D> {
    /// A field of size one, downwards along the last axis.
    fn default() -> Self {
        UniformField { field: std::array::from_fn(|i| if i + 1 == D { -1.0 } else { 0.0 }), gamma: -0.1 }
    }
}

impl<const D: usize> UniformField<D> {
    /// `a . q`, the negative potential.
    #[inline(always)]
    fn work<T: Scalar>(&self, q: &SVector<T, D>) -> T {
        Self::work_of(&self.field, q)
    }

    #[inline(always)]
    fn work_of<C: Coefficient, T: ScalarOver<C>>(field: &[C], q: &SVector<T, D>) -> T {
        field.iter().zip(q).fold(T::zero(), |sum, (a, q)| sum + *q * *a)
    }

    /// The motion after time `t` from any start, for every `gamma` and either sign of `t`, to a few units of round-off
    /// times `1 + |gamma t|` (the exponent is rounded).
    ///
    /// With `x = gamma t`, `f = (e^x - 1)/x`, `g = (e^x - 1 - x)/x^2` and `k = (f^2/2 - g)/x`:
    /// `q = q0 + t f v0 + t^2 g a`, `v = e^x v0 + t f a`,
    /// `z = e^x z0 + t (e^x f |v0|^2/2 + f a.q0 + t f^2 a.v0 + t^2 k |a|^2)`.
    pub fn solution<T: Scalar>(&self, t: f64, start: &VelocityPoint<D, T>) -> VelocityPoint<D, T> {
        let x = self.gamma * t;
        let (sigma, f, g, k) = (x.exp(), relative_exp_m1(x), second_relative_exp(x), third_relative_exp(x));
        let (q0, v0) = (&start.q, &start.v);
        let square: f64 = self.field.iter().map(|a| a * a).sum();
        let rate = dot(v0, v0) * (0.5 * sigma * f) + self.work(q0) * f + self.work(v0) * (t * f * f);
        VelocityPoint {
            q: SVector::from_fn(|i, _| q0[i] + (v0[i] * (t * f) + t * t * g * self.field[i])),
            v: SVector::from_fn(|i, _| v0[i] * sigma + t * f * self.field[i]),
            z: start.z * sigma + (rate + t * t * k * square) * t,
        }
    }

    /// The initial velocity of the motion from `q0` to `q1` in time `h`; `None` for `h = 0`, where there is none or it
    /// is not unique.
    pub fn velocity_through(&self, q0: &SVector<f64, D>, q1: &SVector<f64, D>, h: f64) -> Option<SVector<f64, D>> {
        let x = self.gamma * h;
        let (f, g) = (relative_exp_m1(x), second_relative_exp(x));
        let v = SVector::from_fn(|i, _| ((q1[i] - q0[i]) - h * h * g * self.field[i]) / (h * f));
        Some(v).filter(|v: &SVector<f64, D>| v.iter().all(|v| v.is_finite()))
    }
}

impl<const D: usize> UniformField<D> {
    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        field: &[C],
        gamma: C,
        q: &SVector<T, D>,
        v: &SVector<T, D>,
        z: T,
    ) -> T {
        dot(v, v) * 0.5 + Self::work_of(field, q) + z * gamma
    }
}

impl<const D: usize> Lagrangian<D> for UniformField<D> {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, D>, v: &SVector<T, D>, z: T) -> T {
        Self::formula(&self.field, self.gamma, q, v, z)
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

/// `field[i]` and `gamma`.
impl<const D: usize> Parametric<D> for UniformField<D> {
    fn parameter_names(&self) -> Vec<String> {
        indexed_names("field", D).chain(["gamma".to_owned()]).collect()
    }
    fn parameters(&self) -> Vec<f64> {
        self.field.into_iter().chain([self.gamma]).collect()
    }
    #[inline(always)]
    fn parameter_count(&self) -> usize {
        D + 1
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let (gamma, field) = theta.split_last()?;
        Some(UniformField { field: field.try_into().ok()?, gamma: *gamma })
    }
    #[inline(always)]
    fn value_at<T: Scalar>(&self, theta: &[T], _t: T, q: &SVector<T, D>, v: &SVector<T, D>, z: T) -> T {
        let Some((gamma, field)) = theta.split_last() else { return T::from(f64::NAN) };
        Self::formula(field, *gamma, q, v, z)
    }
}

impl<const D: usize> System<D> for UniformField<D> {
    fn name(&self) -> &'static str {
        "uniform_field"
    }

    /// A throw from the origin at 45 degrees.
    fn initial(&self) -> VelocityPoint<D> {
        let v = SVector::from_fn(|i, _| if i == 0 || i + 1 == D { 1.0 } else { 0.0 });
        VelocityPoint { q: SVector::zeros(), v, z: 0.0 }
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<D>) {
        let q = SVector::from_fn(|i, _| between(-3.0, 3.0, u[i]));
        let v = SVector::from_fn(|i, _| between(-2.0, 2.0, u[D + i]));
        (between(0.0, 5.0, u[2 * D + 1]), VelocityPoint { q, v, z: between(-1.0, 1.0, u[2 * D]) })
    }

    fn hamiltonian<T: Scalar>(&self, _t: T, x: &PhasePoint<D, T>) -> Option<T> {
        Some(dot(x.p, x.p) * 0.5 - self.work(&x.q) - x.z * self.gamma)
    }

    /// The translations along the axes on which the field has no component.
    fn symmetries(&self) -> Vec<Symmetry<D>> {
        let axis = |i: usize| SVector::from_fn(|j, _| if i == j { 1.0 } else { 0.0 });
        (0..D).filter(|i| self.field[*i] == 0.0).map(|i| Symmetry::Translation(axis(i))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_geom::{
        Derivatives, OneParameterGroup,
        numbers::{MaxAbsOrNan, MaxOrNan},
    };

    const GAMMAS: [f64; 9] = [-1e3, -40.0, -2.5, -0.1, -1e-9, 0.0, 1e-15, 0.7, 3.0];
    const EPS: f64 = f64::EPSILON;
    const FIELD: [f64; 2] = [0.6, -1.3];

    fn start() -> VelocityPoint<2> {
        VelocityPoint::new([0.3, -0.2], [1.7, 0.9], -0.4)
    }

    /// Each formula has some 20 roundings of terms of the result's scale; the exponential adds `|gamma t|` units.
    fn tolerance(gamma: f64, t: f64) -> f64 {
        (20.0 + 4.0 * (gamma * t).abs()) * EPS
    }

    /// Compares q and v relative to the size of the two points, and z relative to its square.
    fn assert_close(x: &VelocityPoint<2>, y: &VelocityPoint<2>, tolerance: f64, what: &str) {
        let size = 1.0_f64.max_or_nan(x.q.max_abs_or_nan()).max_or_nan(x.v.max_abs_or_nan());
        assert!(
            (x.q - y.q).max_abs_or_nan().max_or_nan((x.v - y.v).max_abs_or_nan()) <= tolerance * size,
            "{what}: {x:?} and {y:?}"
        );
        assert!((x.z - y.z).abs() <= tolerance * x.z.abs().max_or_nan(size * size), "{what}: {} and {}", x.z, y.z);
    }

    /// The Taylor series of the Herglotz equations themselves, 40 terms: at `|gamma t| <= 2` exact to round-off.
    fn taylor(system: &UniformField<2>, t: f64, start: &VelocityPoint<2>) -> VelocityPoint<2> {
        let (mut q, mut v, mut z) = (vec![start.q], vec![start.v], vec![start.z]);
        for k in 0..40 {
            let kinetic: f64 = (0..=k).map(|i| v[i].dot(&v[k - i]) * 0.5).sum();
            let (next, field) = ((k + 1) as f64, SVector::from(system.field));
            z.push((kinetic + field.dot(&q[k]) + system.gamma * z[k]) / next);
            q.push(v[k] / next);
            v.push((if k == 0 { field } else { SVector::zeros() } + v[k] * system.gamma) / next);
        }
        let sum = |c: &[SVector<f64, 2>]| c.iter().rev().fold(SVector::zeros(), |sum, c| sum * t + c);
        VelocityPoint { q: sum(&q), v: sum(&v), z: z.iter().rev().fold(0.0, |sum, c| sum * t + c) }
    }

    #[test]
    fn the_closed_form_is_the_series_of_the_equations() {
        for gamma in GAMMAS {
            let system = UniformField { field: FIELD, gamma };
            for t in [-0.8, -1e-3, 0.0, 1e-8, 1e-3, 0.1, 0.8].map(|t| if gamma < -2.5 { t * 2.0 / -gamma } else { t }) {
                let what = format!("{gamma}, {t}");
                assert_close(&system.solution(t, &start()), &taylor(&system, t, &start()), 32.0 * EPS, &what);
            }
        }
    }

    #[test]
    fn the_increment_of_the_action_keeps_its_digits_in_a_short_time() {
        let start = VelocityPoint { z: 0.0, ..start() };
        for (gamma, t) in GAMMAS.into_iter().flat_map(|gamma| [1e-8, 1e-5, 1e-3].map(|t| (gamma, t))) {
            let system = UniformField { field: FIELD, gamma };
            let (a, b) = (system.solution(t, &start).z, taylor(&system, t, &start).z);
            assert!((a - b).abs() <= 12.0 * EPS * b.abs(), "gamma = {gamma}, t = {t}: {a} and {b}");
        }
    }

    #[test]
    fn motions_compose_and_the_energy_decays_at_the_rate_gamma() {
        for gamma in GAMMAS {
            let (system, t1, t2) = (UniformField { field: FIELD, gamma }, 0.75, 1.25);
            let once = system.solution(t1 + t2, &start());
            let twice = system.solution(t2, &system.solution(t1, &start()));
            assert_close(&once, &twice, tolerance(gamma, t1 + t2), &format!("gamma = {gamma}"));
            let energy = |x: &VelocityPoint<2>| dot(x.v, x.v) * 0.5 - system.work(&x.q) - gamma * x.z;
            let expected = energy(&start()) * (gamma * (t1 + t2)).exp();
            let size = expected.abs() + dot(once.v, once.v) + system.work(&once.q).abs() + (gamma * once.z).abs();
            assert!((energy(&once) - expected).abs() <= tolerance(gamma, t1 + t2) * (1.0 + size), "gamma = {gamma}");
        }
    }

    #[test]
    fn without_a_field_it_is_the_free_particle_and_without_drag_the_parabola() {
        let (system, free) = (UniformField { field: [0.0], gamma: -0.7 }, super::super::FreeParticle { gamma: -0.7 });
        let x = VelocityPoint::new([0.3], [1.7], -0.4);
        let (a, b) = (system.solution(1.3, &x), free.solution(1.3, &x));
        assert!((a.q[0] - b.q[0]).abs().max_or_nan((a.v[0] - b.v[0]).abs()).max_or_nan((a.z - b.z).abs()) <= 4.0 * EPS);
        for gamma in [0.0, 1e-200] {
            let fall = UniformField { field: [-1.0], gamma };
            let end = fall.solution(2.0, &VelocityPoint::new([0.25], [1.5], 0.5));
            // The action of the parabola: 0.5 + 2 (1.5^2/2 - 0.25 - 2 * 1.5 + 4/3).
            assert_eq!((end.q[0], end.v[0]), (1.25, -0.5));
            assert!((end.z - (0.5 + 2.0 * (1.125 - 0.25 - 3.0 + 4.0 / 3.0))).abs() <= 4.0 * EPS);
        }
    }

    #[test]
    fn the_velocity_through_two_points_is_the_one_that_starts_the_motion() {
        let (from, v) = (SVector::zeros(), start().v);
        for (gamma, h) in GAMMAS.into_iter().flat_map(|gamma| [1e-8, 1e-3, 0.5, 2.0].map(|h| (gamma, h))) {
            let system = UniformField { field: FIELD, gamma };
            let end = system.solution(h, &VelocityPoint { q: from, v, z: 0.0 }).q;
            let Some(found) = system.velocity_through(&from, &end, h) else {
                unreachable!("a motion exists for every h > 0")
            };
            // The displacement by the field is subtracted, so that its size contributes to the error.
            let size = 1.7 + h * second_relative_exp(gamma * h) / relative_exp_m1(gamma * h) * 1.3;
            assert!((found - v).max_abs_or_nan() <= size * tolerance(gamma, h), "gamma = {gamma}, h = {h}: {found}");
            assert_eq!(system.velocity_through(&from, &from, 0.0), None);
            assert_eq!(system.velocity_through(&from, &end, 0.0), None);
        }
    }

    #[test]
    fn what_is_declared_holds() {
        let system = UniformField { field: [0.0, 0.4, 0.0], gamma: -0.3 };
        let (t, x) = system.sample(&[0.1, 0.7, 0.4, 0.9, 0.2, 0.6, 0.3, 0.8]);
        assert!(system.structure().defects(&system, t, &x).unwrap().all(|d| d.size <= 1e-15));
        assert_eq!(system.symmetries().len(), 2);
        assert!(system.symmetries().iter().all(|s| s.symmetry_defect(&system, t, &x) <= 1e-15));
        assert_eq!(UniformField::<2>::default().field, [0.0, -1.0]);
        let p = system.gradient(t, &x).y;
        let energy = dot(x.v, p) - system.value(t, &x.q, &x.v, x.z);
        let Some(hamiltonian) = system.hamiltonian(t, &PhasePoint { q: x.q, p, z: x.z }) else { unreachable!() };
        assert!((energy - hamiltonian).abs() <= 8.0 * EPS);
    }
}
