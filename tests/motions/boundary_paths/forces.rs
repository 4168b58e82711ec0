//! Paths with forces: they are the runs of the same rule, Newton's method converges quadratically, and closed forms.

use super::end_conditions::closes;
use super::{EPS, at, by, check, largest_of};
use crate::common::forces::{Drag, Fall, G, Swirl};
use crate::common::slope;
use crate::forces::{forced_one, forced_two};
use crate::lagrangians::{one, two};
use contact_examples::systems::{CoupledPlane, HarmonicOscillator, Pendulum, QuadraticInZ, UniformField};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{MaxAbsOrNan, MaxOrNan, max_abs_or_nan};
use contact_geom::{Force, Lagrangian, PhasePoint, Scalar, VelocityPoint, legendre};
use discrete_herglotz::boundary::{BoundaryPath, CriticalPath, End, branch};
use discrete_herglotz::rules::{Flow, Method, Node, Rule};
use discrete_herglotz::splitting::ActionStrang;
use discrete_herglotz::theory::DiscretePath;
use discrete_herglotz::{DiscreteLagrangian, Stepper};
use std::f64::consts::PI;

/// Simpson's rule for the action, as a user writes it.
const SIMPSON: Rule = Rule {
    name: "simpson",
    order: 2,
    nodes: &[
        Node { weight: 1.0 / 6.0, place: 0.0, action: 0.0 },
        Node { weight: 4.0 / 6.0, place: 0.5, action: 0.5 },
        Node { weight: 1.0 / 6.0, place: 1.0, action: 1.0 },
    ],
};

/// The drag `-c |v| v`, coordinate by coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Quadratic(f64);

impl<const N: usize> Force<N> for Quadratic {
    fn value<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        x.v.map(|v| -(v * v.abs() * self.0))
    }
}

/// A force on the first and the last coordinate, which in a plane has full matrices and vectors as its derivatives in
/// q, v and z, with a period of 3 in t.
#[derive(Clone, Copy, Debug)]
pub struct Mixing;

impl<const N: usize> Force<N> for Mixing {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        let ([a, b], [u, w]) = ([x.q[0], x.q[N - 1]], [x.v[0], x.v[N - 1]]);
        let drive = (t * (2.0 * PI / 3.0)).sin();
        let mut force = SVector::zeros();
        force[0] = (b * 1.3).sin() * 0.4 - u * w * 0.2 - u * u.abs() * (b * b + 1.0) * 0.1 + drive * 0.2;
        force[N - 1] = (a * b) * 0.5 - a * 0.3 + u * 0.15 - w * (a * a + 0.4) * 0.3 + (x.z * 0.5).cos() * w * 0.1;
        force
    }
}

/// The states of a run of a rule.
fn run<D: DiscreteLagrangian<N>, const N: usize>(
    ld: &D,
    (t0, start): (f64, PhasePoint<N>),
    steps: usize,
) -> Vec<PhasePoint<N>> {
    let mut flow = Flow::new(ld, t0, start).unwrap();
    let mut states = vec![start];
    for _ in 0..steps {
        flow.advance(1).unwrap();
        states.push(*Flow::state(&flow));
    }
    states
}

/// The largest distance between a path and the positions of a run.
fn distance<const N: usize>(found: &CriticalPath<N>, states: &[PhasePoint<N>]) -> f64 {
    max_abs_or_nan(found.points.iter().zip(states).map(|(q, state)| (q - state.q).max_abs_or_nan()))
}

/// Between the ends of a run of a rule there is the run, by positions and by momenta. From a path that is off by 1e-3
/// Newton's corrections are quadratic: to 1e-6, 1e-12, and round-off.
fn assert_is_the_run<D: DiscreteLagrangian<N>, const N: usize>(name: &str, ld: &D, t0: f64, start: PhasePoint<N>) {
    let steps = 40;
    let states = run(ld, (t0, start), steps);
    let (first, last) = (states[0], states[steps]);
    let size = largest_of(&states.iter().map(|x| x.q).collect::<Vec<_>>());
    // The rounding of a position, eps q in each step, is one of eps q / h in a momentum, which moves the positions
    // within the span by up to k h eps q / h = k eps q.
    let bound = 2.0 * EPS * steps as f64 * size;
    let given = |p: SVector<f64, N>| End::Momentum(p);
    let (q0, q1) = (End::Position(first.q), End::Position(last.q));
    for (what, ends) in [
        ("positions", [q0, q1]),
        ("p0 and q1", [given(first.p), q1]),
        ("q0 and p1", [q0, given(last.p)]),
        ("momenta", [given(first.p), given(last.p)]),
    ] {
        let problem = BoundaryPath::new(ld, steps, ends).unwrap().starting_at(t0, start.z).unwrap();
        let found = problem.search();
        check(ld, (t0, start.z), &found, 1.0);
        let off = distance(&found, &states);
        assert!(off <= bound, "{name}, {what}: {off:e} of {bound:e}");
        assert!(
            (found.action() - last.z).abs() <= bound.max_or_nan(16.0 * EPS * steps as f64 * last.z.abs()),
            "{name}, {what}"
        );
        assert!(found.iterations <= 8, "{name}, {what}: {} corrections", found.iterations);
        assert_eq!(problem.index(&found).unwrap(), None);
        let bent = found.points.iter().enumerate().map(|(k, q)| q.map(|c| c + 1e-3 * (0.7 * k as f64 + c).sin()));
        let again = problem.from_path(DiscretePath::new(bent.collect()).unwrap()).unwrap().search();
        assert!(again.is_found() && again.iterations <= 4, "{name}, {what}: {} from 1e-3", again.iterations);
        assert!(distance(&again, &states) <= bound, "{name}, {what}");
    }
}

/// Every rule, on a pendulum with quadratic drag beside that of the action, on a Lagrangian that is nonlinear in z, and
/// on a plane with a full mass matrix and a force that depends on everything.
#[test]
fn paths_are_the_runs_of_their_rules() {
    fn of<const N: usize, L: Lagrangian<N> + Clone>(name: &str, system: L, t0: f64, x: VelocityPoint<N>) {
        // The span of 1.2 is shorter than a quarter of a period, before which the path with a given momentum is the only one.
        let (h, start) = (0.03, legendre(&system, t0, &x));
        for method in Method::RULES {
            assert_is_the_run(&format!("{name} {method}"), &by(*method, system.clone(), h), t0, start);
        }
        assert_is_the_run(&format!("{name} simpson"), &SIMPSON.of(system, h).unwrap(), t0, start);
    }
    let pendulum = forced_one(one(Pendulum { gamma: -0.1 }), Quadratic(0.3));
    of("pendulum", pendulum, 0.0, VelocityPoint::new([0.3], [0.9], 0.0));
    let nonlinear = forced_one(one(QuadraticInZ { c: 0.7 }), Quadratic(0.3));
    of("nonlinear in z", nonlinear, 0.0, VelocityPoint::new([0.2], [0.5], 0.3));
    let plane = forced_two(two(CoupledPlane { c: 1.5, ..CoupledPlane::default() }), Mixing);
    of("plane", plane, 0.3, VelocityPoint::new([0.2, 0.1], [0.4, 0.3], 0.2));
}

/// Splittings with kicks.
#[test]
fn paths_of_splittings() {
    let (h, start) = (0.05, PhasePoint::new([0.3], [0.6], 0.2));
    let pendulum = forced_one(one(Pendulum { gamma: -0.1 }), Swirl);
    assert_is_the_run("strang", &Method::Strang.discretise(pendulum, h, 0.3, &start).unwrap(), 0.3, start);
    let nonlinear = forced_one(one(QuadraticInZ { c: 0.7 }), Swirl);
    assert_is_the_run("action_strang", &ActionStrang::new(nonlinear, h, 0.3, &start).unwrap(), 0.3, start);
}

/// Driven periodic motions with drag: they close, Newton's corrections are quadratic, and other motions converge to
/// them.
#[test]
fn periodic_paths_with_forces() {
    fn of<D: DiscreteLagrangian<N>, const N: usize>(ld: &D, steps: usize, z0: f64) -> CriticalPath<N> {
        let problem = BoundaryPath::periodic(ld, steps, SVector::zeros()).unwrap().starting_at(0.0, z0).unwrap();
        let found = problem.search();
        closes(ld, z0, &found, [0.0; N]);
        assert!(found.iterations <= 8 && problem.index(&found).unwrap().is_none(), "{}", found.iterations);
        let mut bent: Vec<_> = found.points.iter().map(|q| q.map(|c| c + 1e-3 * (40.0 * c).sin())).collect();
        bent[steps] = bent[0];
        let again = problem.from_path(DiscretePath::new(bent).unwrap()).unwrap().search();
        assert!(again.is_found() && again.iterations <= 4, "{} from 1e-3", again.iterations);
        found
    }
    let steps = 60;
    let ld = by(Method::Midpoint, forced_two(Rolling, Drag { c: 0.4, k: 0.1 }), 3.0 / steps as f64);
    let found = of(&ld, steps, 0.0);
    // By friction of 0.4 over forty periods of 3 the distance of two motions is e^-24 of the initial one, 4e-11.
    let start = PhasePoint { q: found.points[0] + SVector::repeat(0.1), p: SVector::zeros(), z: 0.0 };
    let states = run(&ld, (0.0, start), 40 * steps);
    assert!(distance(&found, &states[39 * steps..]) <= 1e-9, "{:e}", distance(&found, &states[39 * steps..]));
    // Where forces and Lagrangian depend on the action.
    let plane = forced_two(two(CoupledPlane { c: 1.5, ..CoupledPlane::default() }), Mixing);
    of(&by(Method::Trapezoidal, plane, 3.0 / steps as f64), steps, 0.2);
    of(&SIMPSON.of(plane, 3.0 / steps as f64).unwrap(), steps, 0.2);
}

/// Two balls in wells with a spring, one driven with the period 3.
#[derive(Clone, Copy, Debug)]
pub struct Rolling;

impl Lagrangian<2> for Rolling {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        let drive = (t * (2.0 * PI / 3.0)).cos() * 0.4;
        let wells = q[0] * q[0] * 0.5 + q[1] * q[1] * q[1] * q[1] * 0.25 + q[1] * q[1] * 0.4;
        (v[0] * v[0] + v[1] * v[1]) * 0.5 - wells - q[0] * q[1] * 0.2 + drive * q[0]
    }
}

/// A fall with quadratic drag from rest covers `(1/k) ln cosh(sqrt(gk) t)`: the path between the two positions has the
/// order of its rule. For rules of order two the estimate of the error is within a factor of two of it.
#[test]
fn a_fall_with_quadratic_drag() {
    let (k, span) = (0.2, 2.0);
    let exact = |t: f64| -((G * k).sqrt() * t).cosh().ln() / k;
    let forced = forced_one(Fall, Drag { c: 0.0, k });
    for method in [Method::Rectangle, Method::Midpoint, Method::Trapezoidal] {
        let errors = [32usize, 64, 128, 256].map(|steps| {
            let h = span / steps as f64;
            let ld = by(method, forced, h);
            let found = BoundaryPath::new(&ld, steps, [at([0.0]), at([exact(span)])]).unwrap().search();
            check(&ld, (0.0, 0.0), &found, 1.0);
            let error = max_abs_or_nan(found.points.iter().enumerate().map(|(k, q)| q[0] - exact(k as f64 * h)));
            let estimate = found.error_estimate.map(|part| part * exact(span).abs());
            assert_eq!(estimate.is_some(), method.order() == 2, "{method}");
            assert!(estimate.is_none_or(|e| e > 0.5 * error && e < 2.0 * error), "{method}: {estimate:?} of {error:e}");
            (h, error)
        });
        let order = slope(&errors);
        assert!((order - f64::from(method.order())).abs() <= 0.15, "{method}: {order} {errors:?}");
    }
}

/// The midpoint rule for an oscillator with the linear drag of a force, `q'' = -q - c q'`: with `a, b = 1/h + h/4 +- c/2`
/// the equation of a point is `a q2 - (2/h - h/2) q1 + b q0 = 0`, and its solutions are `r^k (A cos k theta + B sin k
/// theta)`, `r^2 = b/a`. The step is such that the point m is conjugate to the start, where rows are exchanged.
#[test]
fn conjugate_points_with_drag() {
    let c = 0.3;
    let solution = |h: f64| {
        let (a, b) = (1.0 / h + 0.25 * h + 0.5 * c, 1.0 / h + 0.25 * h - 0.5 * c);
        (((1.0 / h - 0.25 * h) / (a * b).sqrt()).acos(), (b / a).sqrt())
    };
    for (m, steps) in [(10usize, 17usize), (10, 25), (20, 31)] {
        let (mut low, mut high) = (1e-3, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if solution(middle).0 * (m as f64) < PI { low = middle } else { high = middle }
        }
        let (theta, r) = solution(low);
        let (cosine, sine) = (0.3, 0.8);
        let exact = |k: usize| {
            let angle = k as f64 * theta;
            r.powi(k as i32) * (cosine * angle.cos() + sine * angle.sin())
        };
        let ld = by(Method::Midpoint, forced_one(one(HarmonicOscillator { gamma: 0.0 }), Drag { c, k: 0.0 }), low);
        let (q, before) = (exact(steps), exact(steps - 1));
        // `p1 = (q1 - q0)/h - h/4 (q0 + q1) - c/2 (q1 - q0)`.
        let p = (q - before) * (1.0 / low - 0.5 * c) - 0.25 * low * (q + before);
        for end in [at([q]), End::Momentum([p].into())] {
            let found = BoundaryPath::new(&ld, steps, [at([0.3]), end]).unwrap().search();
            check(&ld, (0.0, 0.0), &found, 1.0);
            assert!(found.iterations <= 3, "m = {m}, {end:?}: {}", found.iterations);
            let off = max_abs_or_nan((0..=steps).map(|k| found.points[k][0] - exact(k)));
            // The errors of the given positions, and of each equation, grow by the inverse of the regularity; theta has
            // the rounding of an arc cosine, eps / theta, times k.
            let bound = 16.0 * EPS * (steps as f64 / theta) / found.regularity;
            assert!(off <= bound, "m = {m}, {steps} steps, {end:?}: {off:e} of {bound:e}");
        }
    }
}

/// A branch along the coefficient of the drag ends at the path that is found there; and the forces of a formula without
/// any vanish.
#[test]
fn a_branch_along_the_drag() {
    let ends = [at([0.0]), at([1.2])];
    let pendulum = one(Pendulum { gamma: -0.1 });
    let problem = |c: f64| BoundaryPath::new(Rule::MIDPOINT.of(forced_one(pendulum, Quadratic(c)), 0.05)?, 40, ends);
    let paths = branch(problem, [0.0, 1.0], 0.2, 50).unwrap();
    let (last, found) = (&paths[paths.len() - 1], problem(1.0).unwrap().search());
    assert!(last.0 == 1.0 && last.1.is_found() && found.is_found(), "{}", last.0);
    // Two searches for one path, each to the rounding of the positions in 40 steps.
    let off = largest_of(&found.points.iter().zip(&last.1.points).map(|(a, b)| a - b).collect::<Vec<_>>());
    assert!(off <= 16.0 * EPS * 40.0 * 1.2, "{off:e}");
    let free = BoundaryPath::new(&Rule::MIDPOINT.of(pendulum, 0.05).unwrap(), 40, ends).unwrap().search();
    assert!((0..=40).all(|k| (free.points[k] - paths[0].1.points[k]).max_abs_or_nan() <= 16.0 * EPS * 40.0 * 1.2));
}

/// `ln(q - 1/2)`, which is not defined for q below 1/2.
#[derive(Clone, Copy, Debug)]
pub struct Wall;

impl<const N: usize> Force<N> for Wall {
    fn value<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        x.q.map(|q| (q - 0.5).ln())
    }
}

/// A drag that is not finite at a step is a status, and the search does not end in a path.
#[test]
fn forces_that_are_not_defined_are_a_status() {
    let ld = by(Method::Midpoint, forced_one(UniformField::<1> { field: [-1.0], gamma: 0.0 }, Wall), 0.1);
    let found = BoundaryPath::new(&ld, 10, [at([0.0]), at([1.0])]).unwrap().search();
    assert!(!found.is_found(), "{}", found.status);
}
