//! The accuracy of velocities: where the momenta determine them badly, and where coordinates differ in size.

use crate::lagrangians::Two;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint, numbers::max_or_nan};
use discrete_herglotz::{AnyIntegrator, InputError, Problem, SelectionFailure, Status, Steps, Until, Vector};

/// A charge in a field: `v.v/2 + B (x v_y - y v_x)/2`. Its velocity rotates by the angle `B t`, and `p = v + B (-y,
/// x)/2` is much larger than it.
#[derive(Clone, Copy, Debug)]
pub struct Charge {
    b: f64,
    structured: bool,
}

impl Lagrangian<2> for Charge {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        (v[0] * v[0] + v[1] * v[1]) * 0.5 + (q[0] * v[1] - q[1] * v[0]) * (0.5 * self.b)
    }
    fn structure(&self) -> Structure {
        if !self.structured {
            return Structure::default();
        }
        Structure {
            autonomous: true,
            constant_mass: true,
            quadratic: true,
            constant_rate: true,
            ..Structure::default()
        }
    }
}

const V: [f64; 2] = [0.6, 0.8];

fn far_away() -> VelocityPoint<2> {
    VelocityPoint::new([1.0, 0.0], V, 0.0)
}

/// The distance of a velocity from that of the charge in a field, whose speed is 1.
fn off(b: f64, t: f64, v: Option<Vector>) -> f64 {
    let (sin, cos) = (b * t).sin_cos();
    // v' = B (v_y, -v_x).
    let exact = SVector::from([V[0] * cos + V[1] * sin, V[1] * cos - V[0] * sin]);
    v.map_or(f64::NAN, |v| (v - exact).norm())
}

/// The velocity is as accurate as the state for any strength of the field: by the default integrator, and by those of
/// low order, whose steps are as long as the error allows.
#[test]
fn a_strong_magnetic_field() {
    for structured in [false, true] {
        for b in [1.0, 1e3, 1e5, 1e7] {
            for turns in [3.0, 40.0] {
                let charge = Two::from(Charge { b, structured });
                let (problem, t) = (Problem::new(&charge, 0.0, far_away()).unwrap(), turns / b);
                // In stronger fields the reference of their trial runs is refused because of the rounding between its
                // nodes.
                let low = if b <= 1e5 { [2, 3].as_slice() } else { &[] };
                for stages in low.iter().copied().map(Some).chain([None]) {
                    let run = problem.accuracy(1e-6);
                    let run = stages
                        .map(|stages| AnyIntegrator::Gauss { stages })
                        .into_iter()
                        .fold(run, |run, by| run.by(by));
                    let outcome = run.run(Until::Time(t)).unwrap();
                    assert_eq!((outcome.status, outcome.unresolved), (Status::Completed, None), "B = {b:e}");
                    let off = off(b, t, outcome.v);
                    assert!(off <= 1e-6, "B = {b:e}, {turns} radians, {stages:?}: {off:e}");
                }
            }
        }
    }
}

/// Where the rounding of the momentum exceeds the velocity, an accuracy is refused.
#[test]
fn a_velocity_below_the_rounding_of_the_momentum() {
    const B: f64 = 1e13;
    let charge = Two::from(Charge { b: B, structured: false });
    let problem = Problem::new(&charge, 0.0, far_away()).unwrap();
    let refused = problem.accuracy(1e-6).plan(Until::Time(40.0 / B)).err();
    assert!(
        matches!(refused, Some(InputError::Accuracy { cause: SelectionFailure::RoundOff, reached, .. }) if reached > 1e-4),
        "{refused:?}"
    );
}

/// The error estimate of given steps includes the velocity: it is the difference from half the steps, `1 - 2^-4` of the
/// error.
#[test]
fn estimates_cover_the_velocity() {
    for (b, h) in [(1.0, 0.5), (1e5, 0.5), (1e7, 0.25)] {
        let charge = Two::from(Charge { b, structured: false });
        let problem = Problem::new(&charge, 0.0, far_away()).unwrap();
        let run = problem.by(AnyIntegrator::Gauss { stages: 2 }).steps(Steps::Size(h / b)).with_error_estimate();
        let outcome = run.run(Until::Time(10.0 / b)).unwrap();
        let (off, estimate) = (off(b, outcome.t, outcome.v), outcome.error_estimate.unwrap_or(f64::NAN));
        assert!(estimate >= 0.8 * off && estimate <= 1.1 * off, "B = {b:e}: {off:e}, estimated {estimate:e}");
    }
}

/// The error estimate of a motion that begins and ends at rest is relative to its speed in between.
#[test]
fn an_end_at_rest_is_no_error_of_the_velocity() {
    let oscillators = Two::from(Oscillators { coupling: 0.0 });
    let problem = Problem::new(&oscillators, 0.0, VelocityPoint::new([1.0, 0.5], [0.0; 2], 0.0)).unwrap();
    let (t, steps) = (64.0 * std::f64::consts::TAU, 1024);
    let run = problem.by(AnyIntegrator::Gauss { stages: 4 }).steps(Steps::Count(steps)).with_error_estimate();
    let estimate = run.run(Until::Time(t)).unwrap().error_estimate.unwrap_or(f64::NAN);
    // The error of the phase of a step is h^9 (4!)^2 / (8! 9!), that of the Pade approximation of exp.
    let phase = steps as f64 * (t / steps as f64).powi(9) * 24f64.powi(2) / (40320.0 * 362880.0);
    // The next term is about h^2/20 of it, and the difference from half steps 1 - 2^-8.
    assert!((estimate / phase - 1.0).abs() <= 0.05, "{estimate:e}, {phase:e}");
    let chosen = problem.accuracy(1e-9).run(Until::Time(t)).unwrap();
    assert_eq!((chosen.status, chosen.unresolved), (Status::Completed, None));
}

/// Two oscillators, the second the faster the further the first is from its centre: `v.v/2 - x^2/2 - (1 + c x^2)
/// y^2/2`.
#[derive(Clone, Copy, Debug)]
pub struct Oscillators {
    coupling: f64,
}

impl Lagrangian<2> for Oscillators {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        let squares = [q[0] * q[0], q[1] * q[1]];
        (v[0] * v[0] + v[1] * v[1] - squares[0] - (squares[0] * self.coupling + 1.0) * squares[1]) * 0.5
    }
    fn structure(&self) -> Structure {
        Structure {
            autonomous: true,
            separable: true,
            constant_mass: true,
            constant_rate: true,
            z_affine: true,
            ..Structure::default()
        }
    }
}

/// A small coordinate that becomes fast is resolved where its scale is given, and is not resolved otherwise.
#[test]
fn each_coordinate_by_its_own_scale() {
    const SMALL: f64 = 1e-8;
    let system = Two::from(Oscillators { coupling: 900.0 });
    let problem = Problem::new(&system, 0.0, VelocityPoint::new([0.0, SMALL], [1.0, 0.0], 0.0)).unwrap();
    for t in [5.0, 33.0] {
        let exact =
            problem.by(AnyIntegrator::Gauss { stages: 16 }).steps(Steps::Size(0.01)).run(Until::Time(t)).unwrap();
        let off = |scales: Option<[f64; 2]>| {
            let run = problem.accuracy(1e-6);
            let outcome = scales.into_iter().fold(run, |run, scales| run.scales(scales)).run(Until::Time(t)).unwrap();
            let of_q = (outcome.q - &exact.q).component_div(&[1.0, SMALL]);
            // The small coordinate is 30 times as fast.
            let of_v = (outcome.v.unwrap() - exact.v.as_ref().unwrap()).component_div(&[30.0, 30.0 * SMALL]);
            max_or_nan(of_q.norm(), of_v.norm())
        };
        let (with, without) = (off(Some([1.0, SMALL])), off(None));
        assert!(with <= 1e-6, "t = {t}: {with:e}");
        assert!(without > 1e-5, "t = {t}: {without:e}, the scales change nothing");
    }
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = problem.accuracy(1e-6).scales([1.0, scale]).plan(Until::Time(1.0)).err();
        assert!(matches!(refused, Some(InputError::Scale { index: 1, .. })), "{refused:?}");
    }
}
