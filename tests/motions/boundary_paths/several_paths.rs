//! Several paths between the same ends: by deflation, by continuation, and from a given initial path.

use super::{EPS, at, check, size};
use crate::common::lagrangians::Bratu;
use crate::lagrangians::{One, one, two};
use contact_examples::systems::{DoublePendulum, Pendulum};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{MaxAbsOrNan, max_abs_or_nan};
use contact_geom::{VelocityPoint, legendre};
use discrete_herglotz::DiscreteLagrangian;
use discrete_herglotz::boundary::{BoundaryPath, CriticalPath, PathStatus, continuation};
use discrete_herglotz::rules::Rule;
use discrete_herglotz::theory::{DiscretePath, discrete_flow};

/// Both solutions by deflation, a minimum of the action and one of index 1, against `q = -2 ln(cosh(a (t - 1/2)) /
/// cosh(a / 2))` with `2 a^2 = lambda cosh^2(a / 2)`.
#[test]
fn bratu_has_two_paths_or_none() {
    let (lambda, steps) = (2.0, 400);
    let ld = Rule::MIDPOINT.of(One::from(Bratu::undamped(lambda)), 1.0 / steps as f64).unwrap();
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
    let ld = Rule::MIDPOINT.of(One::from(Bratu::undamped(4.0)), 1.0 / steps as f64).unwrap();
    let none = BoundaryPath::new(&ld, steps, [at([0.0]), at([0.0])]).unwrap().search();
    assert!(matches!(none.status, PathStatus::Stalled | PathStatus::NotConverged), "{}", none.status);
    assert!(none.points.len() == steps + 1 && none.residual > 1e-4 && none.residual < 0.1, "{:e}", none.residual);
}

/// A pendulum has several motions between two positions in a given time.
#[test]
fn several_paths_of_a_pendulum_by_deflation() {
    let (h, steps) = (0.05, 200);
    let ld = Rule::MIDPOINT.of(one(Pendulum { gamma: -0.05 }), h).unwrap();
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
            let apart = max_abs_or_nan(path.points.iter().zip(&other.points).map(|(a, b)| (a - b).max_abs_or_nan()));
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

/// Continuation in a parameter and in the number of steps, to a path that is not found from the straight line.
#[test]
fn continuation_follows_a_path() {
    // The distance of the ends grows to several turns.
    let ld = Rule::MIDPOINT.of(one(Pendulum { gamma: -0.05 }), 0.05).unwrap();
    let problem = |k: u32| BoundaryPath::new(&ld, 100, [at([0.0]), at([0.2 * f64::from(k)])]).unwrap();
    let paths = continuation((0..=40).map(problem)).unwrap();
    assert!(paths.len() == 41 && paths.iter().all(CriticalPath::is_found));
    check(&ld, (0.0, 0.0), &paths[40], 8.0);
    // With refined steps each path is the start of the next, and two corrections suffice for the last.
    let refined = |n: usize| {
        let ld = Rule::MIDPOINT.of(two(DoublePendulum::default()), 1.0 / n as f64).unwrap();
        BoundaryPath::new(ld, n, [at([0.0, 0.1]), at([0.9, 0.4])]).unwrap()
    };
    let paths = continuation([7, 50, 400, 401].map(refined)).unwrap();
    assert!(paths.iter().all(CriticalPath::is_found));
    assert_eq!(paths.iter().map(|path| path.points.len()).collect::<Vec<_>>(), [8, 51, 401, 402]);
    // Where no path exists continuation ends, and keeps the paths found before.
    let bratu = |lambda: f64| {
        BoundaryPath::new(
            Rule::MIDPOINT.of(One::from(Bratu::undamped(lambda)), 0.01).unwrap(),
            100,
            [at([0.0]), at([0.0])],
        )
    };
    let paths = continuation([3.0, 3.4, 3.6, 3.8].map(|lambda| bratu(lambda).unwrap())).unwrap();
    assert_eq!(paths.iter().map(CriticalPath::is_found).collect::<Vec<_>>(), [true, true, false]);
}

/// A user's initial path whose ends differ from the given ones is moved to them, and determines which path is found.
#[test]
fn the_initial_path_of_the_user() {
    let (h, steps) = (0.05, 160);
    let ld = Rule::MIDPOINT.of(one(Pendulum { gamma: -0.05 }), h).unwrap();
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
    let off = max_abs_or_nan((0..=steps).map(|k| (found.points[k] - motion[k]).max_abs_or_nan()));
    // The round-off of the flow, eps/h a step, over the span.
    assert!(off <= 64.0 * EPS / h * steps as f64, "{off:e}");
}
