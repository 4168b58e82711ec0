//! Critical paths between given ends: against the discrete Herglotz equations, the differential of the action, the flow
//! and closed forms. (`scale --case path` compares them with Newton's method on a sparse factorisation.)

// In a test a missing value is a failure.
#![allow(missing_docs, clippy::unwrap_used)]

// Other targets use the rest of it.
#[allow(dead_code)]
mod common;

use common::lagrangians::Bratu;
use contact_geom::nalgebra::SVector;
use contact_geom::systems::{
    CoupledPlane, DoublePendulum, Duffing, FreeParticle, HarmonicOscillator, Kepler, Pendulum, QuadraticInZ,
    Relativistic, System,
};
use contact_geom::{
    DiscretePoint, GeometryError, Lagrangian, PhasePoint, Scalar, VelocityPoint, legendre,
    numbers::{MaxAbsOrNan, max_abs_or_nan},
};
use discrete_herglotz::boundary::{BoundaryPath, CriticalPath, End, PathStatus, continuation};
use discrete_herglotz::{
    DiscreteLagrangian, InputError, StepError,
    gauss::Gauss,
    rules::{AnyDiscreteLagrangian, Method, Midpoint},
    theory::{DiscretePath, discrete_action, discrete_flow, legendre_minus, legendre_plus},
};
use proptest::prelude::*;
use std::f64::consts::PI;

const EPS: f64 = f64::EPSILON;

fn at<const N: usize>(q: [f64; N]) -> End<N> {
    End::Position(q.into())
}

fn largest_of<const N: usize>(v: &[SVector<f64, N>]) -> f64 {
    max_abs_or_nan(v.iter().map(MaxAbsOrNan::max_abs_or_nan))
}

/// The size of the terms of the discrete Herglotz equations along a path: the momenta, and the change of a momentum by
/// the rounding of the positions.
fn size<D: DiscreteLagrangian<N>, const N: usize>(ld: &D, t0: f64, path: &CriticalPath<N>) -> f64 {
    let of = |k: usize| {
        let x = DiscretePoint { q0: path.points[k], q1: path.points[k + 1], z0: path.actions[k] };
        let jet = ld.second_jet(t0 + k as f64 * ld.step_size(), &x).unwrap();
        jet.first.d1.max_abs_or_nan()
            + jet.first.d2.max_abs_or_nan()
            + jet.d12.max_abs_or_nan() * N as f64 * largest_of(&path.points)
    };
    max_abs_or_nan((0..path.points.len() - 1).map(of))
}

/// Checks that every path that is found must pass: the discrete Herglotz equations, `dA_d`, the action, the flow.
fn check<D: DiscreteLagrangian<N>, const N: usize>(ld: &D, (t0, z0): (f64, f64), found: &CriticalPath<N>, units: f64) {
    assert_eq!(found.status, PathStatus::Found, "{}", found.status);
    let path = found.path().unwrap();
    // Each of the three positions of an equation is rounded, and the equation is a sum of a few terms: some units in
    // the last place of the largest. `units` is 1 for closed forms, and larger where L_d is itself the result of an
    // iteration.
    let bound = 16.0 * units * EPS * size(ld, t0, found);
    let residuals = path.herglotz_residuals(ld, t0, z0).unwrap();
    assert!(largest_of(&residuals) <= bound, "residual {:e} of {bound:e}", largest_of(&residuals));
    assert!((largest_of(&residuals) <= found.residual * 1.01 + bound) && found.residual <= bound);
    // The differential of A_d is the residual times the product of the later sigma_d, below 1 with damping.
    let differential = path.action_differential(ld, t0, z0).unwrap();
    let steps = path.steps();
    assert!(largest_of(&differential[1..steps]) <= bound.max(bound * (-found.log_factor).exp()));
    // The action is the sum of its recursion, up to the rounding of another order of summation.
    let action = discrete_action(ld, t0, path.points(), z0).unwrap();
    assert!(
        (action - found.action()).abs() <= 16.0 * EPS * units * max_abs_or_nan(found.actions.iter().copied()),
        "{action}"
    );
    // The flow from the first two points: an error in the second one grows like the distance of neighbouring motions.
    let h = ld.step_size();
    let mut x = DiscretePoint { q0: found.points[0], q1: found.points[1], z0 };
    let mut worst: f64 = 0.0;
    for k in 0..steps - 1 {
        x = discrete_flow(ld, t0 + k as f64 * h, &x).unwrap();
        worst = worst.max((x.q1 - found.points[k + 2]).amax());
    }
    // The error of the first velocity is eps q / h, and grows along the span, by `e^span` where motions separate (with
    // rates of about one).
    let span = h * steps as f64;
    let growth = span * span.exp() / h;
    assert!(worst <= 64.0 * units * EPS * largest_of(&found.points).max(1.0) * growth, "flow {worst:e}");
}

fn by<L: Lagrangian<N>, const N: usize>(method: Method, system: L, h: f64) -> AnyDiscreteLagrangian<L, N> {
    let origin = PhasePoint { q: SVector::repeat(0.1), p: SVector::repeat(0.1), z: 0.0 };
    method.discretise(system, h, 0.0, &origin).unwrap()
}

/// Every method, on systems that are nonlinear in q, in z, forced, and with a mass that depends on the position.
#[test]
fn every_method_finds_critical_paths() {
    fn run<const N: usize, S: System<N>>(system: &S, ends: [[f64; N]; 2], (t0, z0): (f64, f64)) {
        let (steps, span) = (60, 1.5);
        for method in Method::applicable(&system.structure()) {
            let ld = by(method, system, span / steps as f64);
            let problem = BoundaryPath::new(&ld, steps, [at(ends[0]), at(ends[1])]).unwrap();
            let problem = problem.starting_at(t0, z0).unwrap();
            check(&ld, (t0, z0), &problem.search(), 1.0);
        }
    }
    run(&Pendulum::default(), [[0.0], [1.0]], (0.0, 0.0));
    run(&QuadraticInZ { c: 0.7 }, [[0.3], [-1.0]], (0.0, 0.8));
    run(&Duffing::forced(), [[0.0], [0.5]], (0.4, 0.0));
    run(&DoublePendulum::default(), [[0.1, 0.0], [0.9, 0.4]], (0.0, 0.2));
    run(&CoupledPlane::default(), [[0.1, 0.0], [0.3, 0.4]], (0.0, 0.2));
}

/// Contact Gauss collocation is a discrete Lagrangian like any other.
#[test]
fn gauss_collocation_finds_critical_paths() {
    let ld = Gauss::new(QuadraticInZ { c: 0.7 }, 3, 0.25).unwrap();
    let found = BoundaryPath::new(&ld, 8, [at([0.3]), at([-1.0])]).unwrap().starting_at(0.0, 0.8).unwrap().search();
    // Its jets depend on stages that are found by iteration, with an error of some more units.
    check(&ld, (0.0, 0.8), &found, 16.0);
    let ld = Gauss::new(DoublePendulum::default(), 2, 0.1).unwrap();
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
    let ld = Midpoint::new(HarmonicOscillator { gamma }, h).unwrap();
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
    let system = DoublePendulum::default();
    let ends = [at([0.1, 0.0]), at([0.9, 0.4])];
    let ld = Gauss::new(&system, 6, 0.1).unwrap();
    let truth = BoundaryPath::new(&ld, 10, ends).unwrap().search();
    assert!(truth.is_found());
    let error = |every: usize| {
        let ld = Midpoint::new(&system, 0.1 / every as f64).unwrap();
        let found = BoundaryPath::new(&ld, 10 * every, ends).unwrap().search();
        assert!(found.is_found());
        max_abs_or_nan((0..=10).map(|k| (found.points[k * every] - truth.points[k]).amax()))
    };
    let errors = [4, 8, 16, 32].map(error);
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        // The band for measured orders.
        assert!((order - 2.0).abs() <= 0.15, "{order} of {errors:?}");
    }
}

/// The index of the undamped oscillator between points that are not conjugate is the number of half periods of the rule
/// within.
#[test]
fn the_index_counts_conjugate_points() {
    for (h, steps) in [(0.02, 50), (0.02, 150), (0.02, 170), (0.1, 40), (0.1, 70), (0.1, 200), (0.25, 4000)] {
        let ld = Midpoint::new(HarmonicOscillator { gamma: 0.0 }, h).unwrap();
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
        let ld = Midpoint::new(HarmonicOscillator { gamma: 0.0 }, h).unwrap();
        let problem = BoundaryPath::new(&ld, steps, [at([0.3]), at([1.0])]).unwrap();
        let found = problem.search();
        assert!(found.is_found() && found.iterations <= 3, "{m}, {steps}: {} after {}", found.status, found.iterations);
        assert!(found.residual <= 32.0 * EPS * size(&ld, 0.0, &found), "{:e}", found.residual);
        assert_eq!(problem.index(&found).unwrap(), Some((steps - 1) / m), "m = {m}, {steps} steps");
    }
    // Two uncoupled oscillators in a plane, with conjugate points at different times.
    let ld = Midpoint::new(Plane { stiffness: [1.0, 3.0] }, 2.0).unwrap();
    let problem = BoundaryPath::new(&ld, 7, [at([0.3, 0.1]), at([1.0, -0.4])]).unwrap();
    let found = problem.search();
    assert!(found.is_found(), "{}", found.status);
    // Angles pi/2 and 2 pi/3 a step: conjugate after 2, 4, 6 steps and after 1.5, 3, 4.5, 6: 3 and 4 within 7.
    assert_eq!(problem.index(&found).unwrap(), Some(3 + 4));
}

/// Two uncoupled oscillators.
struct Plane {
    stiffness: [f64; 2],
}

impl Lagrangian<2> for Plane {
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
        let ld = Midpoint::new(HarmonicOscillator { gamma: 0.0 }, h).unwrap();
        let found = BoundaryPath::new(&ld, steps, [at([0.3]), at([1.0])]).unwrap().search();
        assert!(matches!(found.status, PathStatus::Conjugate { .. }), "{}", found.status);
        assert!(found.points.len() == steps + 1 && found.residual > 0.01 && found.residual.is_finite());
    }
    // The position of a free particle with two free ends is not determined.
    let ld = Midpoint::new(FreeParticle::default(), 0.1).unwrap();
    let found = BoundaryPath::new(&ld, 10, [End::Free, End::Free]).unwrap().search();
    assert!(matches!(found.status, PathStatus::Conjugate { .. }), "{}", found.status);
}

/// Both solutions by deflation, a minimum of the action and one of index 1, against `q = -2 ln(cosh(a (t - 1/2)) /
/// cosh(a / 2))` with `2 a^2 = lambda cosh^2(a / 2)`.
#[test]
fn bratu_has_two_paths_or_none() {
    let (lambda, steps) = (2.0, 400);
    let ld = Midpoint::new(Bratu::undamped(lambda), 1.0 / steps as f64).unwrap();
    let problem = BoundaryPath::new(&ld, steps, [at([0.0]), at([0.0])]).unwrap();
    let lower = problem.search();
    let upper = problem.clone().avoiding(&[&lower], 1.0).unwrap().search();
    for (found, index, bracket) in [(&lower, 0, [0.5, 2.4]), (&upper, 1, [2.4, 8.0])] {
        check(&ld, (0.0, 0.0), found, 1.0);
        assert_eq!(problem.index(found).unwrap(), Some(index));
        let (maximum, a) = Bratu::maximum(lambda, bracket);
        // The error has order 2, with a constant that is the fourth derivative of the upper solution, about a^4.
        let bound = a.powi(4) / (steps * steps) as f64;
        assert!((found.points[steps / 2][0] - maximum).abs() <= bound, "{} {maximum}", found.points[steps / 2][0]);
    }
    let ld = Midpoint::new(Bratu::undamped(4.0), 1.0 / steps as f64).unwrap();
    let none = BoundaryPath::new(&ld, steps, [at([0.0]), at([0.0])]).unwrap().search();
    assert!(matches!(none.status, PathStatus::Stalled | PathStatus::NotConverged), "{}", none.status);
    assert!(none.points.len() == steps + 1 && none.residual > 1e-4 && none.residual < 0.1, "{:e}", none.residual);
}

/// A pendulum has several motions between two positions in a given time.
#[test]
fn several_paths_of_a_pendulum_by_deflation() {
    let (h, steps) = (0.05, 200);
    let ld = Midpoint::new(Pendulum { gamma: -0.05 }, h).unwrap();
    let problem = BoundaryPath::new(&ld, steps, [at([0.0]), at([0.5])]).unwrap();
    let mut found = vec![problem.search()];
    for _ in 0..4 {
        let known: Vec<_> = found.iter().collect();
        let next = problem.clone().avoiding(&known, 1.0).unwrap().search();
        if !next.is_found() {
            break;
        }
        found.push(next);
    }
    assert!(found.len() >= 4, "{}", found.len());
    for (i, path) in found.iter().enumerate() {
        assert_eq!(path.status, PathStatus::Found);
        assert!(path.residual <= 16.0 * EPS * size(&ld, 0.0, path));
        for other in &found[..i] {
            let apart = max_abs_or_nan(path.points.iter().zip(&other.points).map(|(a, b)| (a - b).amax()));
            assert!(apart > 0.1, "{apart}");
        }
    }
    let indices: Vec<_> = found.iter().map(|path| problem.index(path).unwrap().unwrap()).collect();
    // The inertia of the whole Hessian by finite differences of dA_d, as an independent reference.
    for (path, &index) in found.iter().zip(&indices) {
        assert_eq!(index, negative_directions(&ld, path), "{indices:?}");
    }
    // At least two kinds of critical points.
    assert!(indices.iter().max() > indices.iter().min(), "{indices:?}");
}

/// The negative eigenvalues of the Hessian of `A_d` in the interior points, by central differences of the paper's
/// formula for `dA_d`.
fn negative_directions<D: DiscreteLagrangian<1>>(ld: &D, path: &CriticalPath<1>) -> usize {
    let steps = path.points.len() - 1;
    let mut hessian = contact_geom::nalgebra::DMatrix::zeros(steps - 1, steps - 1);
    let delta = 1e-5;
    for j in 1..steps {
        let moved = |by: f64| {
            let mut points = path.points.clone();
            points[j][0] += by;
            DiscretePath::new(points).unwrap().action_differential(ld, 0.0, path.actions[0]).unwrap()
        };
        let (more, less) = (moved(delta), moved(-delta));
        for i in 1..steps {
            hessian[(i - 1, j - 1)] = (more[i][0] - less[i][0]) / (2.0 * delta);
        }
    }
    let symmetric = (&hessian + hessian.transpose()) * 0.5;
    symmetric.symmetric_eigenvalues().iter().filter(|value| **value < 0.0).count()
}

/// Momenta at one end, at both, and free ends: the momenta are those of the discrete Legendre transforms, and a free
/// end is critical.
#[test]
fn momenta_and_free_ends() {
    let (h, steps, z0) = (0.01, 60, 0.4);
    let ld = Midpoint::new(QuadraticInZ { c: 0.7 }, h).unwrap();
    let given = |p: f64| End::Momentum([p].into());
    let cases = [
        [given(0.3), at([1.0])],
        [at([0.2]), given(-0.4)],
        [given(0.3), given(-0.4)],
        [at([0.2]), End::Free],
        [End::Free, at([0.2])],
    ];
    for ends in cases {
        let problem = BoundaryPath::new(&ld, steps, ends).unwrap().starting_at(0.0, z0).unwrap();
        let found = problem.search();
        check(&ld, (0.0, z0), &found, 1.0);
        let point = |k: usize| DiscretePoint { q0: found.points[k], q1: found.points[k + 1], z0: found.actions[k] };
        let p0 = legendre_minus(&ld, 0.0, &point(0)).unwrap().p[0];
        let p1 = legendre_plus(&ld, 0.0, &point(steps - 1)).unwrap().p[0];
        // The rounding of a position changes a momentum by W/h times the rounding.
        let bound = 16.0 * EPS * largest_of(&found.points) / h;
        for (end, p, q) in [(ends[0], p0, found.points[0]), (ends[1], p1, found.points[steps])] {
            match end {
                End::Position(given) => assert_eq!(q, given),
                End::Momentum(given) => assert!((p - given[0]).abs() <= bound, "{p}"),
                End::Free => assert!(p.abs() <= bound, "{p}"),
            }
        }
        // On a short path the action is minimal, except in the direction of a shift of all points where no position is
        // given: the shift raises the potential `q^2/2`, and lowers the action.
        let shifts = ends.iter().all(|end| !matches!(end, End::Position(_)));
        assert_eq!(problem.index(&found).unwrap(), Some(usize::from(shifts)));
    }
}

/// Periodic motions of forced and damped systems: also by the flow over many periods, under which other motions
/// converge to them by damping.
#[test]
fn periodic_paths_of_forced_systems() {
    let system = Duffing { alpha: 1.0, beta: 0.05, force: 0.3, omega: 1.2, gamma: -0.25 };
    let steps = 128;
    let ld = Midpoint::new(system, 2.0 * PI / 1.2 / steps as f64).unwrap();
    let problem = BoundaryPath::periodic(&ld, steps, [0.0].into()).unwrap();
    let found = problem.search();
    assert_eq!(found.points[0], found.points[steps]);
    assert_eq!(problem.index(&found).unwrap(), None);
    closes(&ld, 0.0, &found, [0.0]);
    // From another state, after forty periods with a factor e^(-0.125 * 5.2) each, the distance is 1e-11 of the initial
    // one.
    let (mut x, h) = (DiscretePoint { q0: [0.5].into(), q1: [0.5].into(), z0: 0.0 }, ld.step_size());
    for k in 0..40 * steps {
        x = discrete_flow(&ld, k as f64 * h, &x).unwrap();
    }
    assert!((x.q0 - found.points[0]).amax() <= 1e-10, "{} {}", x.q0, found.points[0]);

    // Two coordinates, one of them never at rest.
    let ld = Midpoint::new(Driven, 0.05).unwrap();
    let found = BoundaryPath::periodic(&ld, 60, [0.0, 0.0].into()).unwrap().starting_at(0.0, 0.2).unwrap().search();
    closes(&ld, 0.2, &found, [0.0, 0.0]);
    // Forces that depend on the action, and different positions at the ends.
    let ld = Midpoint::new(QuadraticInZ::default(), 0.1).unwrap();
    let found = BoundaryPath::periodic(&ld, 30, [1.0].into()).unwrap().starting_at(0.0, 0.3).unwrap().search();
    closes(&ld, 0.3, &found, [1.0]);
}

fn closes<D: DiscreteLagrangian<N>, const N: usize>(ld: &D, z0: f64, found: &CriticalPath<N>, shift: [f64; N]) {
    check(ld, (0.0, z0), found, 1.0);
    let steps = found.points.len() - 1;
    let point = |k: usize| DiscretePoint { q0: found.points[k], q1: found.points[k + 1], z0: found.actions[k] };
    let start = legendre_minus(ld, 0.0, &point(0)).unwrap();
    let end = legendre_plus(ld, ld.step_size() * (steps - 1) as f64, &point(steps - 1)).unwrap();
    let q = largest_of(&found.points);
    assert!((found.points[steps] - found.points[0] - SVector::from(shift)).amax() <= 4.0 * EPS * q);
    // The rounding of a position changes a momentum by W/h times the rounding.
    assert!((start.p - end.p).amax() <= 32.0 * EPS * q / ld.step_size(), "{} {}", start.p, end.p);
}

/// A pendulum with a torque and an oscillator, forced with the period 3, with a drag that depends on the action.
struct Driven;

impl Lagrangian<2> for Driven {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let force = (t * (2.0 * PI / 3.0)).cos() * 0.2;
        let potential = q[0].cos() * 0.8 - q[1] * q[1] * 0.4 + q[0].sin() * q[1] * 0.3;
        (v[0] * v[0] + v[1] * v[1]) * 0.5 + potential + force * q[1] + q[0] * 0.1 - z * z * 0.01
    }
}

/// Continuation in a parameter and in the number of steps, to a path that is not found from the straight line.
#[test]
fn continuation_follows_a_path() {
    // The distance of the ends grows to several turns.
    let ld = Midpoint::new(Pendulum { gamma: -0.05 }, 0.05).unwrap();
    let problem = |k: u32| BoundaryPath::new(&ld, 100, [at([0.0]), at([0.2 * f64::from(k)])]).unwrap();
    let paths = continuation((0..=40).map(problem)).unwrap();
    assert!(paths.len() == 41 && paths.iter().all(CriticalPath::is_found));
    check(&ld, (0.0, 0.0), &paths[40], 8.0);
    // With refined steps each path is the start of the next, and two corrections suffice for the last.
    let refined = |n: usize| {
        let ld = Midpoint::new(DoublePendulum::default(), 1.0 / n as f64).unwrap();
        BoundaryPath::new(ld, n, [at([0.0, 0.1]), at([0.9, 0.4])]).unwrap()
    };
    let paths = continuation([7, 50, 400, 401].map(refined)).unwrap();
    assert!(paths.iter().all(CriticalPath::is_found));
    assert_eq!(paths.iter().map(|path| path.points.len()).collect::<Vec<_>>(), [8, 51, 401, 402]);
    // Where no path exists continuation ends, and keeps the paths found before.
    let bratu = |lambda: f64| {
        BoundaryPath::new(Midpoint::new(Bratu::undamped(lambda), 0.01).unwrap(), 100, [at([0.0]), at([0.0])])
    };
    let paths = continuation([3.0, 3.4, 3.6, 3.8].map(|lambda| bratu(lambda).unwrap())).unwrap();
    assert_eq!(paths.iter().map(CriticalPath::is_found).collect::<Vec<_>>(), [true, true, false]);
}

/// Positions outside of the domain, and a conformal factor that is not positive, are reported as a status.
#[test]
fn undefined_paths_are_a_status() {
    // A velocity above the speed of light.
    let ld = Midpoint::new(Relativistic::default(), 0.1).unwrap();
    let found = BoundaryPath::new(&ld, 10, [at([0.0]), at([5.0])]).unwrap().search();
    let StepError::NonFinite = (match found.status {
        PathStatus::Undefined { step: 0, cause } => cause,
        status => panic!("{status}"),
    }) else {
        panic!("{}", found.status)
    };
    assert!(found.points.len() == 11 && found.residual == f64::INFINITY);
    // 1 + h gamma < 0 for the rule that is explicit in z.
    let ld = by(Method::LeftMidpoint, FreeParticle { gamma: -3.0 }, 0.5);
    let found = BoundaryPath::new(&ld, 4, [at([0.0]), at([1.0])]).unwrap().search();
    assert!(matches!(found.status, PathStatus::SigmaVanished { step: 0, sigma } if sigma == -0.5), "{}", found.status);
}

#[test]
fn bad_input_is_refused() {
    let ld = Midpoint::new(Pendulum::default(), 0.1).unwrap();
    let ends = [at([0.0]), at([1.0])];
    for steps in [0, 1] {
        let refused = BoundaryPath::new(&ld, steps, ends);
        assert!(matches!(refused, Err(InputError::Count { least: 2, found, .. }) if found == steps));
        assert!(BoundaryPath::periodic(&ld, steps, [0.0].into()).is_err());
    }
    for bad in [f64::NAN, f64::INFINITY] {
        for ends in [[at([bad]), at([0.0])], [at([0.0]), at([bad])], [at([0.0]), End::Momentum([bad].into())]] {
            let refused = BoundaryPath::new(&ld, 10, ends);
            assert!(matches!(refused, Err(InputError::Geometry(GeometryError::NonFinite { .. }))));
        }
        assert!(BoundaryPath::periodic(&ld, 10, [bad].into()).is_err());
        let problem = || BoundaryPath::new(&ld, 10, ends).unwrap();
        assert!(problem().starting_at(bad, 0.0).is_err() && problem().starting_at(0.0, bad).is_err());
        assert!(problem().avoiding(&[], bad).is_err());
    }
    let problem = || BoundaryPath::new(&ld, 10, ends).unwrap();
    let short = DiscretePath::new(vec![[0.0].into(); 5]).unwrap();
    assert!(matches!(problem().from_path(short), Err(InputError::PathLength { .. })));
    let other = BoundaryPath::new(&ld, 5, ends).unwrap().search();
    assert!(problem().avoiding(&[&other], 1.0).is_err() && problem().index(&other).is_err());
    assert!(problem().avoiding(&[], 0.0).is_err());
}

/// A user's initial path whose ends differ from the given ones is moved to them, and determines which path is found.
#[test]
fn the_initial_path_of_the_user() {
    let (h, steps) = (0.05, 160);
    let ld = Midpoint::new(Pendulum { gamma: -0.05 }, h).unwrap();
    // A motion by the flow, perturbed by a thousandth.
    let start = legendre(&Pendulum { gamma: -0.05 }, 0.0, &VelocityPoint::new([0.2], [1.7], 0.0));
    let mut x = discrete_herglotz::theory::legendre_minus_inverse(&ld, 0.0, &start, &[1.7].into()).unwrap();
    let mut motion = vec![x.q0, x.q1];
    for k in 0..steps - 1 {
        x = discrete_flow(&ld, k as f64 * h, &x).unwrap();
        motion.push(x.q1);
    }
    let disturbed: Vec<_> = (0..=steps).map(|k| motion[k] + SVector::from([1e-3 * (k as f64).cos()])).collect();
    let problem = BoundaryPath::new(&ld, steps, [at([motion[0][0]]), at([motion[steps][0]])]).unwrap();
    let found = problem.from_path(DiscretePath::new(disturbed).unwrap()).unwrap().search();
    check(&ld, (0.0, 0.0), &found, 1.0);
    let off = max_abs_or_nan((0..=steps).map(|k| (found.points[k] - motion[k]).amax()));
    // The round-off of the flow, eps/h a step, over the span.
    assert!(off <= 64.0 * EPS / h * steps as f64, "{off:e}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Between random ends at short spans a path is found, and passes the checks.
    #[test]
    fn random_ends(u in prop::collection::vec(-0.8f64..0.8, 4), steps in 2usize..80, z0 in -1.0f64..1.0) {
        fn run<const N: usize, L: Lagrangian<N>>(system: L, u: &[f64], steps: usize, z0: f64) {
            let ld = Midpoint::new(system, 1.0 / steps as f64).unwrap();
            let ends = [SVector::from_fn(|i, _| u[i]), SVector::from_fn(|i, _| u[i + N])];
            let problem = BoundaryPath::new(&ld, steps, ends.map(End::Position)).unwrap().starting_at(0.3, z0).unwrap();
            let found = problem.search();
            check(&ld, (0.3, z0), &found, 1.0);
            assert!(problem.index(&found).unwrap() == Some(0));
        }
        run(Pendulum::default(), &u, steps, z0);
        run(QuadraticInZ::default(), &u, steps, z0);
        run(Duffing::forced(), &u, steps, z0);
        run(CoupledPlane::default(), &u, steps, z0);
        run(DoublePendulum::default(), &u.iter().map(|u| 0.5 * u).collect::<Vec<_>>(), steps, z0);
    }
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
                    let oscillator = HarmonicOscillator { gamma };
                    let ld = method.discretise(oscillator, span / steps as f64, 0.0, &start).unwrap();
                    let path = BoundaryPath::new(ld, steps, [at([0.0]), at([1.0])]).unwrap().search();
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
        let ld = Midpoint::new(Kepler::<2> { mu: 1.0, gamma: 0.0 }, h).unwrap();
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
