//! Paths satisfy the discrete Herglotz equations, with the order of their method.

use super::{EPS, at, by, check, largest_of};
use crate::lagrangians::{one, two};
use contact_examples::systems::{CoupledPlane, DoublePendulum, Duffing, HarmonicOscillator, Pendulum, QuadraticInZ};
use contact_geom::Lagrangian;
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{MaxAbsOrNan, max_abs_or_nan};
use discrete_herglotz::boundary::{BoundaryPath, End};
use discrete_herglotz::gauss::Gauss;
use discrete_herglotz::rules::{Method, Rule};
use proptest::prelude::*;

/// Every method, on systems that are nonlinear in q, in z, forced, and with a mass that depends on the position.
#[test]
fn every_method_finds_critical_paths() {
    fn run<const N: usize, L: Lagrangian<N> + Clone>(system: L, ends: [[f64; N]; 2], (t0, z0): (f64, f64)) {
        let (steps, span) = (60, 1.5);
        for method in Method::applicable(&system.structure()) {
            let ld = by(method, system.clone(), span / steps as f64);
            let problem = BoundaryPath::new(&ld, steps, [at(ends[0]), at(ends[1])]).unwrap();
            let problem = problem.starting_at(t0, z0).unwrap();
            check(&ld, (t0, z0), &problem.search(), 1.0);
        }
    }
    run(one(Pendulum::default()), [[0.0], [1.0]], (0.0, 0.0));
    run(one(QuadraticInZ { c: 0.7 }), [[0.3], [-1.0]], (0.0, 0.8));
    run(one(Duffing::forced()), [[0.0], [0.5]], (0.4, 0.0));
    run(two(DoublePendulum::default()), [[0.1, 0.0], [0.9, 0.4]], (0.0, 0.2));
    run(two(CoupledPlane::default()), [[0.1, 0.0], [0.3, 0.4]], (0.0, 0.2));
}

/// Contact Gauss collocation is a discrete Lagrangian like any other.
#[test]
fn gauss_collocation_finds_critical_paths() {
    let ld = Gauss::new(one(QuadraticInZ { c: 0.7 }), 3, 0.25).unwrap();
    let found = BoundaryPath::new(&ld, 8, [at([0.3]), at([-1.0])]).unwrap().starting_at(0.0, 0.8).unwrap().search();
    // Its jets depend on stages that are found by iteration, with an error of some more units.
    check(&ld, (0.0, 0.8), &found, 16.0);
    let ld = Gauss::new(two(DoublePendulum::default()), 2, 0.1).unwrap();
    let found = BoundaryPath::new(&ld, 10, [at([0.0, 0.1]), at([0.5, 0.2])]).unwrap().search();
    check(&ld, (0.0, 0.0), &found, 16.0);
}

/// The midpoint rule on the damped oscillator: with `a = 1/h^2 + 1/4` and `b = 1/h^2 - 1/4` the discrete Herglotz
/// equation is `a q2 - (1 + sigma) b q1 + sigma a q0 = 0`, whose solutions are `sigma^(k/2) (A cos k theta + B sin k
/// theta)`, `cos theta = (1 + sigma) b / (2 sqrt(sigma) a)`.
#[test]
fn the_damped_oscillator_in_closed_form() {
    let (gamma, h, steps) = (-0.2, 0.05, 400);
    let sigma: f64 = (1.0 + 0.5 * h * gamma) / (1.0 - 0.5 * h * gamma);
    let (a, b) = (1.0 / (h * h) + 0.25, 1.0 / (h * h) - 0.25);
    let theta = ((1.0 + sigma) * b / (2.0 * sigma.sqrt() * a)).acos();
    let (first, last) = (0.3, 1.0);
    let decay = |k: usize| sigma.powf(0.5 * k as f64);
    let n = steps as f64 * theta;
    let other = (last / decay(steps) - first * n.cos()) / n.sin();
    let ld = Rule::MIDPOINT.of(one(HarmonicOscillator { gamma }), h).unwrap();
    let found = BoundaryPath::new(&ld, steps, [at([first]), at([last])]).unwrap().search();
    check(&ld, (0.0, 0.0), &found, 1.0);
    let exact = |k: usize| decay(k) * (first * (k as f64 * theta).cos() + other * (k as f64 * theta).sin());
    let off = max_abs_or_nan((0..=steps).map(|k| found.points[k][0] - exact(k)));
    // theta comes from an arc cosine near 1: its rounding is eps / theta, times k; and the distance of the ends from
    // conjugate ones is 1/sin(n).
    let bound = 8.0 * EPS * (steps as f64 / theta) / n.sin().abs() * largest_of(&found.points);
    assert!(off <= bound, "{off:e} of {bound:e}");
    assert!((found.log_factor - steps as f64 * sigma.ln()).abs() <= 4.0 * EPS * steps as f64);
}

/// Half of the step gives a quarter of the error, against the motion by collocation of order 12.
#[test]
fn the_order_of_convergence() {
    let system = two(DoublePendulum::default());
    let ends = [at([0.1, 0.0]), at([0.9, 0.4])];
    let ld = Gauss::new(system, 6, 0.1).unwrap();
    let truth = BoundaryPath::new(&ld, 10, ends).unwrap().search();
    assert!(truth.is_found());
    let error = |every: usize| {
        let ld = Rule::MIDPOINT.of(system, 0.1 / every as f64).unwrap();
        let found = BoundaryPath::new(&ld, 10 * every, ends).unwrap().search();
        assert!(found.is_found());
        max_abs_or_nan((0..=10).map(|k| (found.points[k * every] - truth.points[k]).max_abs_or_nan()))
    };
    let errors = [4, 8, 16, 32].map(error);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        // The band for measured orders.
        assert!((order - 2.0).abs() <= 0.15, "{order} of {errors:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Between random ends at short spans a path is found, and passes the checks.
    #[test]
    fn random_ends(u in prop::collection::vec(-0.8f64..0.8, 4), steps in 2usize..80, z0 in -1.0f64..1.0) {
        fn run<const N: usize, L: Lagrangian<N>>(system: L, u: &[f64], steps: usize, z0: f64) {
            let ld = Rule::MIDPOINT.of(system, 1.0 / steps as f64).unwrap();
            let ends = [SVector::from_fn(|i, _| u[i]), SVector::from_fn(|i, _| u[i + N])];
            let problem = BoundaryPath::new(&ld, steps, ends.map(End::Position)).unwrap().starting_at(0.3, z0).unwrap();
            let found = problem.search();
            check(&ld, (0.3, z0), &found, 1.0);
            assert!(problem.index(&found).unwrap() == Some(0));
        }
        run(one(Pendulum::default()), &u, steps, z0);
        run(one(QuadraticInZ::default()), &u, steps, z0);
        run(one(Duffing::forced()), &u, steps, z0);
        run(two(CoupledPlane::default()), &u, steps, z0);
        run(two(DoublePendulum::default()), &u.iter().map(|u| 0.5 * u).collect::<Vec<_>>(), steps, z0);
    }
}
