//! Random impacts: none is missed, none occurs twice.

use crate::common::draws::Draws;
use crate::lagrangians::SwitchingTwo;
use contact_geom::numbers::dot;
use contact_geom::switching::{Impact, Impacts, Surface};
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint, nalgebra::SVector};
use discrete_herglotz::{AnyIntegrator, Problem, Resets, Status, StepError, Steps, Until};

/// A flight in a uniform field with linear drag, in closed form.
#[derive(Clone, Copy, Debug)]
pub struct Flight {
    g: f64,
    gamma: f64,
}

impl Lagrangian<2> for Flight {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        dot(v, v) * 0.5 - q[1] * self.g + z * self.gamma
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_affine: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

impl Flight {
    /// The position and the velocity after a time.
    fn after(&self, (q, v): ([f64; 2], [f64; 2]), t: f64) -> ([f64; 2], [f64; 2]) {
        let (g, k) = (self.g, self.gamma);
        let (growth, reach, fall) = match k {
            0.0 => (1.0, t, 0.5 * t * t),
            _ => (f64::exp(k * t), f64::exp_m1(k * t) / k, (f64::exp_m1(k * t) - k * t) / (k * k)),
        };
        ([q[0] + v[0] * reach, q[1] + v[1] * reach - g * fall], [v[0] * growth, v[1] * growth - g * reach])
    }
}

/// An inclined plane `n . q >= 0`.
#[derive(Clone, Copy, Debug)]
pub struct Slope {
    slope: f64,
}

impl Surface<2> for Slope {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>) -> T {
        q[1] - q[0] * self.slope
    }
}

/// The times of the impacts until `t_end`, each by bisection on the closed form, after its first sample below.
fn impacts(flight: &Flight, plane: &Slope, law: Impact, start: ([f64; 2], [f64; 2]), t_end: f64) -> Vec<f64> {
    let height = |q: [f64; 2]| q[1] - plane.slope * q[0];
    let (mut times, mut t, mut state) = (Vec::new(), 0.0, start);
    while times.len() < 40 {
        // A flight over a plane has one maximum: sample until the height is negative beyond it.
        let rate = |v: [f64; 2]| v[1] - plane.slope * v[0];
        let (mut before, mut after) = (0.0, 1e-6);
        while height(flight.after(state, after).0) > 0.0 || rate(flight.after(state, after).1) > 0.0 {
            if after >= t_end - t {
                return times;
            }
            let next = 1.01 * after;
            (before, after) = (after, if next < t_end - t { next } else { t_end - t });
        }
        if before == 0.0 {
            // The flight is shorter than the first sample.
            return times;
        }
        let (mut low, mut high) = (before, after);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            if height(flight.after(state, middle).0) > 0.0 { low = middle } else { high = middle }
        }
        t += low;
        times.push(t);
        let (q, v) = flight.after(state, low);
        let x = VelocityPoint::new(q, v, 0.0);
        let normal = plane.normal(0.0, &x.q);
        // The potential of the conformal law is zero on the ground of the impact.
        let y = match law {
            Impact::Conformal(_) => law.after(&Free, 0.0, &x, (&normal.0, normal.1)).unwrap(),
            _ => law.after(flight, 0.0, &x, (&normal.0, normal.1)).unwrap(),
        };
        state = (q, y.v.into());
    }
    times
}

struct Free;

impl Lagrangian<2> for Free {
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        dot(v, v) * 0.5
    }
}

#[test]
fn ten_thousand_impacts_occur_once_each() {
    let (mut total, mut case) = (0, 0);
    while total < 10_000 {
        case += 1;
        let draws = &mut Draws::of(case);
        let flight = Flight { g: draws.between(0.3, 3.0), gamma: [0.0, draws.between(-0.3, -0.01)][case as usize % 2] };
        let plane = Slope { slope: draws.between(-0.5, 0.5) };
        let law = if case % 3 == 0 { Impact::Elastic } else { Impact::Restitution(draws.between(0.3, 1.0)) };
        let start = ([0.0, draws.between(0.1, 3.0)], [draws.between(-1.0, 1.0), draws.between(-1.0, 1.0)]);
        let (h, t_end) = (f64::exp(draws.between(f64::ln(0.02), f64::ln(5.0))), 20.0);
        let expected = impacts(&flight, &plane, law, start, t_end);
        let system = SwitchingTwo::from(Impacts::new(flight, plane, law));
        let problem = Problem::new(&system, 0.0, VelocityPoint::new(start.0, start.1, 0.0)).unwrap();
        let mut resets = Resets::new();
        let run = problem.by(AnyIntegrator::Gauss { stages: 8 }).steps(Steps::Size(h)).observe(&mut resets);
        let outcome = run.run(Until::Time(t_end)).unwrap();
        let found: Vec<f64> = resets.resets.iter().map(|reset| reset.t).collect();
        let known =
            matches!(outcome.status, Status::Completed | Status::Failed { cause: StepError::Accumulation { .. }, .. });
        assert!(known, "case {case}: {}", outcome.status);
        // Until accumulation is near: the flights of the reference are at least 1e-5 long.
        for (k, t) in expected.iter().enumerate() {
            let previous = if k == 0 { 0.0 } else { expected[k - 1] };
            if t - previous < 1e-3 || *t > outcome.t {
                break;
            }
            let found = found.get(k).copied().unwrap_or(f64::NAN);
            assert!((found - t).abs() <= 1e-9, "case {case}, impact {k} at {t}: {found} (h = {h}, {law:?})");
            total += 1;
        }
        if outcome.status == Status::Completed && expected.len() < 40 {
            assert!(found.len() <= expected.len() + 1, "case {case}: {} for {}", found.len(), expected.len());
        }
    }
}
