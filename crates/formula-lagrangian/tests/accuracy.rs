//! Motions whose parts require steps of very different lengths, or that start from a vanishing force: runs with a
//! required accuracy, compared with closed-form solutions.

use contact_geom::VelocityPoint;
use discrete_herglotz::{InputError, Interrupt, Outcome, Problem, Until};
use formula_lagrangian::Formula;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};

fn run<const N: usize>(text: &str, names: &[&str], q: [f64; N], v: [f64; N], span: f64, wanted: f64) -> Outcome {
    let lagrangian = Formula::parse(text, names, &[]).unwrap().lagrangian::<N>().unwrap();
    let problem = Problem::new(&lagrangian, 0.0, VelocityPoint::new(q, v, 0.0)).unwrap();
    problem.accuracy(wanted).run(Until::Time(span)).unwrap()
}

/// Kepler's problem as text, without a time transformation: from the apocentre through the pericentre, at distances
/// down to a millionth.
#[test]
fn eccentric_orbits_are_followed() {
    for e in [0.9, 0.99, 0.999, 0.999_999] {
        let v = f64::sqrt((1.0 - e) / (1.0 + e));
        let found = run("(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)", &["x", "y"], [1.0 + e, 0.0], [0.0, v], 6.5, 1e-9);
        // The eccentric anomaly from the apocentre, where M = E + e sin E, by Newton's method.
        let mean = 6.5 - 2.0 * PI;
        let mut anomaly = mean / (1.0 + e);
        for _ in 0..50 {
            anomaly -= (anomaly + e * anomaly.sin() - mean) / (1.0 + e * anomaly.cos());
        }
        let (x, y) = (anomaly.cos() + e, f64::sqrt((1.0 - e) * (1.0 + e)) * anomaly.sin());
        let off = (found.q[0] - x).hypot(found.q[1] - y);
        assert!(off <= 1e-9 * x, "{e}: off by {off:e} in {} steps", found.steps);
    }
}

/// Motions from rest under a force that is negligible at first.
#[test]
fn motions_that_begin_at_nothing_are_followed() {
    let power = run("x'^2/2 + t^6*x", &["x"], [0.0], [0.0], 1.0, 1e-9);
    assert!((power.q[0] * 56.0 - 1.0).abs() <= 1e-9, "{}", power.q[0]);
    let pulse = run("x'^2/2 + exp(-((t - 100)/0.5)^2)*x", &["x"], [0.0], [0.0], 200.0, 1e-9);
    let p = 0.5 * PI.sqrt();
    assert!((pulse.p[0] / p - 1.0).abs() <= 1e-9 && (pulse.q[0] / (100.0 * p) - 1.0).abs() <= 1e-9, "{pulse:?}");
}

/// A strong magnetic field, with 1600 revolutions, for which the initial estimate of the steps accounts.
#[test]
fn a_strong_field_is_followed() {
    let found = run("(x'^2 + y'^2)/2 + 1e4*x*y'", &["x", "y"], [0.0, 0.0], [1.0, 0.0], 1.0, 1e-6);
    // p_y = y' + 1e4 x = 0 is conserved, so that x'' = -1e8 x.
    let (x, y) = (1e4_f64.sin() / 1e4, (1e4_f64.cos() - 1.0) / 1e4);
    let off = (found.q[0] - x).hypot(found.q[1] - y).hypot(found.p[0] - 1e4_f64.cos());
    assert!(off <= 1e-6, "{off:e} in {} steps", found.steps);
}

/// A plan ends when the interrupt first returns true, in any of its searches: here the search with equal steps fails,
/// and a search with divided steps follows.
#[test]
fn plans_are_interrupted_in_each_search() {
    let kepler = Formula::parse("(x'^2 + y'^2)/2 + 1/sqrt(x^2 + y^2)", &["x", "y"], &[]).unwrap();
    let kepler = kepler.lagrangian::<2>().unwrap();
    let (asked, yes) = (AtomicUsize::new(0), AtomicUsize::new(usize::MAX));
    let question = || asked.fetch_add(1, Ordering::Relaxed) == yes.load(Ordering::Relaxed);
    let e: f64 = 0.999_999;
    let start = VelocityPoint::new([1.0 + e, 0.0], [0.0, f64::sqrt((1.0 - e) / (1.0 + e))], 0.0);
    let problem = Problem::new(&kepler, 0.0, start).unwrap().with_interrupt(Interrupt::when(&question));
    let plan = |at| {
        yes.store(at, Ordering::Relaxed);
        asked.store(0, Ordering::Relaxed);
        problem.accuracy(1e-9).plan(Until::Time(6.5)).err()
    };
    assert_eq!(plan(usize::MAX), None);
    let questions = asked.load(Ordering::Relaxed);
    assert!(questions > 10, "{questions}");
    for at in 0..questions {
        assert_eq!(plan(at), Some(InputError::Interrupted), "at {at} of {questions}");
        assert_eq!(asked.load(Ordering::Relaxed), at + 1, "{questions}");
    }
}
