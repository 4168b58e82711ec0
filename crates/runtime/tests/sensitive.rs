//! Motions by accuracy that depend on the last digit of their start, and motions that only seem to.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use contact_geom::table::{Interpolation, Table};
use formula_lagrangian::Formula;
use herglotz_runtime::{
    CATALOGUE, InputError, Motion, Outcome, RuntimeError, SelectionFailure, Start, StepControl, System,
};
use std::f64::consts::PI;

/// The end of a motion from rest at t = 0 to an accuracy, or the cause for which it is refused.
fn run(system: &System, q: &[f64], t_end: f64, error: f64) -> Result<Outcome, SelectionFailure> {
    let start = Start::new(0.0, q, vec![0.0; q.len()], 0.0);
    let run = system.run(&Motion::new(start, t_end, StepControl::Accuracy { error, by: None }), &mut ());
    run.map_err(|refused| match refused {
        RuntimeError::Input(InputError::Accuracy { cause, .. }) => Some(cause),
        _ => None,
    })
    .map_err(Option::unwrap)
}

/// The distance of (q, p) at the end, relative to its size.
fn apart(a: &Outcome, b: &Outcome) -> f64 {
    let square = |x: f64, y: f64| (x - y) * (x - y);
    let pairs = || a.q.iter().zip(&b.q).chain(a.p.iter().zip(&b.p));
    let size: f64 = b.q.iter().chain(&b.p).map(|x| x * x).sum();
    (pairs().map(|(x, y)| square(*x, *y)).sum::<f64>() / size).sqrt()
}

/// The double pendulum of the catalogue without drag.
fn double_pendulum() -> System {
    let entry = CATALOGUE.iter().find(|entry| entry.name == "double_pendulum").unwrap();
    System::parse(entry.lagrangian, entry.coordinates, entry.parameters)
        .unwrap()
        .with_parameters(&[("gamma", 0.0)])
        .unwrap()
}

/// An unstable equilibrium at pi, which is not a number of double precision: the last digit of the start grows by
/// `e^t` for the pendulum, and by `e^(1.85 t)` for the double pendulum.
#[test]
fn the_last_digit_of_an_upright_start() {
    let (single, double) = (System::parse("x'^2/2 + cos(x)", &["x"], &[]).unwrap(), double_pendulum());
    let cases = [
        (&single, vec![PI], [(34.0, 1e-3), (40.0, 1e-3), (30.0, 1e-4), (40.0, 1e-4)]),
        (&double, vec![PI, PI], [(30.0, 1e-3), (38.0, 1e-3), (45.0, 1e-3), (38.0, 1e-4)]),
    ];
    for (system, q, requests) in cases {
        for (t_end, error) in requests {
            // Which of the causes is found first depends on the round-off of the runs.
            match run(system, &q, t_end, error).map(|outcome| outcome.q) {
                Err(SelectionFailure::IllConditioned { distance, t }) => {
                    assert!(distance > error && t < t_end, "{q:?} to {t_end}, {error:e}: {distance:e} after {t}");
                }
                Err(SelectionFailure::Chaos { .. }) => {}
                other => panic!("{q:?} to {t_end}, {error:e}: {other:?}"),
            }
        }
    }
}

/// Where the last digit matters less than the requested error, motions are neither refused nor wrong: the end is that of
/// a start that differs in the last digit, and that of a smaller error.
#[test]
fn ordinary_starts_are_accepted() {
    let (pendulum, double) = (System::parse("x'^2/2 + cos(x)", &["x"], &[]).unwrap(), double_pendulum());
    let kepler = System::parse("(x'^2 + y'^2)/2 + 1/hypot(x - 3, y)", &["x", "y"], &[]).unwrap();
    let cases: [(&System, &[f64], f64, f64); 7] = [
        (&pendulum, &[2.5], 100.0, 1e-9),
        (&pendulum, &[1.0], 1000.0, 1e-9),
        (&pendulum, &[PI], 20.0, 1e-3),
        (&double, &[1.0, 0.5], 20.0, 1e-9),
        (&double, &[1.0, 0.5], 60.0, 1e-9),
        // Chaotic, but not for so short a time.
        (&double, &[2.0, 2.5], 20.0, 1e-9),
        (&kepler, &[1.0, 0.5], 1.0, 1e-9),
    ];
    for (system, q, t_end, error) in cases {
        let ends: Vec<Outcome> = [1.0, 1.0 - f64::EPSILON, 1.0 - 2.0 * f64::EPSILON]
            .iter()
            .map(|factor| q.iter().map(|q| q * factor).collect::<Vec<f64>>())
            .zip([error, 0.1 * error, error])
            .map(|(q, error)| run(system, &q, t_end, error).unwrap())
            .collect();
        for other in &ends[1..] {
            // The errors of both.
            assert!(apart(other, &ends[0]) <= 2.0 * error, "{q:?} to {t_end}: {:e}", apart(other, &ends[0]));
        }
    }
}

/// A motion that remains at its start is exact, and a start near zero has all its digits.
#[test]
fn starts_without_an_error() {
    for (l, q) in [("x'^2/2 + x^2/2", 0.0), ("x'^2/2 + (x - 1)^2/2", 1.0), ("x'^2/2 - x^2/2", 0.0)] {
        let system = System::parse(l, &["x"], &[]).unwrap();
        assert_eq!(run(&system, &[q], 100.0, 1e-9).unwrap().q, [q], "{l}");
    }
    // A change of the last digit of 1e-17 is one of the last digit of the motion, x = 1e-17 cosh(t) to first order.
    let system = System::parse("x'^2/2 + x^2/2 - x^4/4", &["x"], &[]).unwrap();
    let end = run(&system, &[1e-17], 30.0, 1e-9).unwrap();
    let linear = 1e-17 * f64::cosh(30.0);
    // The cubic force is x^2 = 3e-9 of the linear one.
    assert!((end.q[0] / linear - 1.0).abs() <= linear * linear, "{} for {linear}", end.q[0]);
}

/// Divided steps that are equal for two bounds on their defect agree with each other whatever their error: the motion
/// returns to 1e-17 after t = 80, and its distance from there to the saddle at 0 is that of the error of the steps.
#[test]
fn equal_divisions_compare_nothing() {
    let system = System::parse("x'^2/2 + x^2/2 - x^4/4", &["x"], &[]).unwrap();
    for error in [1e-3, 1e-4, 1e-6] {
        // Round-off alone decides where the motion goes then, so no end is right.
        let end = run(&system, &[1e-17], 100.0, error).map(|outcome| outcome.q);
        assert!(end.is_err(), "{error:e}: {end:?}");
    }
}

/// Steps end at the samples of a table over time, so that all accuracies are reached, and no table is called chaos.
#[test]
fn tables_of_noisy_samples_reach_an_accuracy() {
    let times: Vec<f64> = (0..450).map(|i| f64::from(i) / 449.0).collect();
    let mut seed = 1_u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let values: Vec<f64> = times.iter().map(|t| (7.0 * t).sin() + noise()).collect();
    for kind in [Interpolation::Linear, Interpolation::Cubic] {
        let table = Table::new(&times, &values, kind).unwrap();
        let l = "x'^2/2 + 9.81*cos(x) - 0.3*z";
        let formula = Formula::parse_with_tables(l, &["x"], &[], &[("u", table)]).unwrap();
        let system = System::new(&formula.with_force("x", "u(t)").unwrap()).unwrap();
        let [coarse, fine] = [1e-9, 1e-12].map(|error| run(&system, &[0.5], 1.0, error).unwrap());
        assert!(apart(&coarse, &fine) <= 1e-9, "{kind:?}");
    }
}
