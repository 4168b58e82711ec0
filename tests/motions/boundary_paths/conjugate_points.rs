//! Conjugate points along a path and at its ends, and paths that are flagged as unresolved.

use super::{EPS, at, size};
use crate::lagrangians::{Two, one};
use contact_examples::systems::{FreeParticle, HarmonicOscillator, Kepler};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::max_abs_or_nan;
use contact_geom::{Lagrangian, PhasePoint, Scalar};
use discrete_herglotz::boundary::{BoundaryPath, CriticalPath, End, PathStatus};
use discrete_herglotz::rules::{Method, Rule};
use std::f64::consts::PI;

/// The index of the undamped oscillator between points that are not conjugate is the number of half periods of the rule
/// within.
#[test]
fn the_index_counts_conjugate_points() {
    for (h, steps) in [(0.02, 50), (0.02, 150), (0.02, 170), (0.1, 40), (0.1, 70), (0.1, 200), (0.25, 4000)] {
        let ld = Rule::MIDPOINT.of(one(HarmonicOscillator { gamma: 0.0 }), h).unwrap();
        let problem = BoundaryPath::new(&ld, steps, [at([0.3]), at([1.0])]).unwrap();
        let found = problem.search();
        assert!(found.is_found());
        let angle = 2.0 * steps as f64 * (0.5 * h).atan();
        assert_eq!(problem.index(&found).unwrap(), Some((angle / PI) as usize), "h = {h}, {steps} steps");
    }
}

/// A conjugate point at a point of the path makes a leading block of the equations singular, to the last digit where
/// the angle of the rule is `pi/2` or `pi/3`; the path itself is regular. (Solving these equations requires an exchange
/// of rows between points.)
#[test]
fn conjugate_points_inside_do_no_harm() {
    for (m, steps) in [(2usize, 3usize), (2, 5), (2, 101), (3, 5), (3, 7), (3, 100), (10, 17), (100, 250)] {
        let h = 2.0 * (PI / m as f64 / 2.0).tan();
        let h = if m == 2 { 2.0 } else { h };
        let ld = Rule::MIDPOINT.of(one(HarmonicOscillator { gamma: 0.0 }), h).unwrap();
        let problem = BoundaryPath::new(&ld, steps, [at([0.3]), at([1.0])]).unwrap();
        let found = problem.search();
        assert!(found.is_found() && found.iterations <= 3, "{m}, {steps}: {} after {}", found.status, found.iterations);
        assert!(found.residual <= 32.0 * EPS * size(&ld, 0.0, &found), "{:e}", found.residual);
        assert_eq!(problem.index(&found).unwrap(), Some((steps - 1) / m), "m = {m}, {steps} steps");
    }
    // Two uncoupled oscillators in a plane, with conjugate points at different times.
    let ld = Rule::MIDPOINT.of(Two::from(Uncoupled { stiffness: [1.0, 3.0] }), 2.0).unwrap();
    let problem = BoundaryPath::new(&ld, 7, [at([0.3, 0.1]), at([1.0, -0.4])]).unwrap();
    let found = problem.search();
    assert!(found.is_found(), "{}", found.status);
    // Angles pi/2 and 2 pi/3 a step: conjugate after 2, 4, 6 steps and after 1.5, 3, 4.5, 6: 3 and 4 within 7.
    assert_eq!(problem.index(&found).unwrap(), Some(3 + 4));
}

/// Two uncoupled oscillators.
#[derive(Clone, Copy, Debug)]
pub struct Uncoupled {
    stiffness: [f64; 2],
}

impl Lagrangian<2> for Uncoupled {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        let part = |i: usize| v[i] * v[i] - q[i] * q[i] * self.stiffness[i];
        (part(0) + part(1)) * 0.5
    }
}

/// Conjugate ends are reported as a status, with the path and its residual.
#[test]
fn conjugate_ends_are_a_status() {
    for (m, steps) in [(2usize, 4usize), (3, 6), (10, 30)] {
        let h = if m == 2 { 2.0 } else { 2.0 * (PI / m as f64 / 2.0).tan() };
        let ld = Rule::MIDPOINT.of(one(HarmonicOscillator { gamma: 0.0 }), h).unwrap();
        let found = BoundaryPath::new(&ld, steps, [at([0.3]), at([1.0])]).unwrap().search();
        assert!(matches!(found.status, PathStatus::Conjugate { .. }), "{}", found.status);
        assert!(found.points.len() == steps + 1 && found.residual > 0.01 && found.residual.is_finite());
    }
    // The position of a free particle with two free ends is not determined.
    let ld = Rule::MIDPOINT.of(one(FreeParticle::default()), 0.1).unwrap();
    let found = BoundaryPath::new(&ld, 10, [End::Free, End::Free]).unwrap().search();
    assert!(matches!(found.status, PathStatus::Conjugate { .. }), "{}", found.status);
}

/// An oscillator from 0 to 1 in half a period has no motion: the path that is found has the amplitude that results from
/// the error of the steps, 155 to 2e7 here. Its error is about as large as its range, however short the steps are,
/// which the pivots do not show. Away from the conjugate point the estimate is the error.
#[test]
fn conjugate_ends_are_flagged() {
    for method in Method::ALL {
        for gamma in [0.0, -0.1] {
            let omega = (1.0 - 0.25 * gamma * gamma).sqrt();
            for steps in [20, 50, 100, 1000, 5000] {
                let path = |span: f64| {
                    let start = PhasePoint::new([0.0], [1.0], 0.0);
                    let oscillator = one(HarmonicOscillator { gamma });
                    let ld = method.discretise(oscillator, span / steps as f64, 0.0, &start).unwrap();
                    let path = BoundaryPath::new(&ld, steps, [at([0.0]), at([1.0])]).unwrap().search();
                    assert!(path.is_found() && path.regularity > 0.0 && path.regularity <= 1.0, "{}", path.status);
                    path
                };
                let conjugate = path(PI / omega);
                let what = format!("{method}, gamma = {gamma}, {steps} steps: {:?}", conjugate.error_estimate);
                assert!(conjugate.unresolved.is_some_and(|s| s.defect > 1.0 && s.step < steps), "{what}");
                assert!(conjugate.error_estimate.is_some_and(|e| e > 0.9), "{what}");
                for span in [1.5, 2.8, 3.6] {
                    let found = path(span);
                    assert_eq!(found.unresolved, None, "{method}, gamma = {gamma}, {steps} steps, span {span}");
                    if *method != Method::Midpoint || gamma != 0.0 {
                        continue;
                    }
                    let exact = |k: usize| (span * k as f64 / steps as f64).sin() / span.sin();
                    let off = max_abs_or_nan((0..=steps).map(|k| (found.points[k][0] - exact(k)).abs()));
                    // The points reach the turning point up to the square of half a step.
                    let range =
                        if span > PI { 1.0 / span.sin().abs() + 1.0 } else { max_abs_or_nan((0..=steps).map(exact)) };
                    let estimate = found.error_estimate.unwrap();
                    // To first order, with third differences at the ends of the path equal to those of the points next
                    // to them: an error of a fifth. Above 1e-9 of the range the rounding of 5000 positions in third
                    // differences of momenta is smaller than that.
                    assert!(
                        (estimate * range / off - 1.0).abs() < 0.2 || estimate < 1e-9,
                        "{span}, {steps}: {estimate:e}, {off:e}"
                    );
                }
            }
        }
    }
}

/// Kepler's problem from (1, 0) to (0, 1) in the time 8, by several paths: where the energy of the steps, which is
/// conserved, jumps, the steps pass the centre without resolving it, and the path is flagged; where the energy is
/// constant the path is not flagged.
#[test]
fn paths_that_jump_a_centre_are_flagged() {
    let ends = [at([1.0, 0.0]), at([0.0, 1.0])];
    let (mut jumped, mut steady) = (0, 0);
    for steps in [40, 60, 80, 100, 150] {
        let h = 8.0 / steps as f64;
        let ld = Rule::MIDPOINT.of(Kepler::<2> { mu: 1.0, gamma: 0.0 }, h).unwrap();
        let problem = BoundaryPath::new(&ld, steps, ends).unwrap();
        let mut known: Vec<CriticalPath<2>> = Vec::new();
        for _ in 0..4 {
            let away = problem.clone().avoiding(&known.iter().collect::<Vec<_>>(), 1.0).unwrap();
            let path = away.search();
            if !path.is_found() {
                continue;
            }
            let energy = |p: &[SVector<f64, 2>]| 0.5 * ((p[1] - p[0]) / h).norm_squared() - 2.0 / (p[0] + p[1]).norm();
            let energies: Vec<f64> = path.points.windows(2).map(energy).collect();
            let mean = energies.iter().sum::<f64>() / energies.len() as f64;
            let spread = max_abs_or_nan(energies.iter().map(|e| (e - mean).abs()));
            let what = format!("{steps} steps: {spread:e}, {:?}, {:?}", path.unresolved, path.error_estimate);
            if spread > 0.5 {
                assert!(path.unresolved.is_some(), "{what}");
                jumped += 1;
            } else if spread < 0.02 {
                assert_eq!(path.unresolved, None, "{what}");
                steady += 1;
            }
            known.push(path);
        }
    }
    assert!(jumped >= 2 && steady >= 5, "{jumped}, {steady}");
}
