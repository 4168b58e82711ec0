//! Several critical paths between the same ends: folds of branches, deflation next to a fold and where no path exists;
//! and paths that do not fit in memory.

use crate::common::lagrangians::Bratu;
use crate::lagrangians::{One, Two, one, two};
use contact_examples::systems::{CoupledPlane, HarmonicOscillator, Pendulum, QuadraticInZ};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{MaxAbsOrNan, max_abs_or_nan, max_or_nan};
use contact_geom::{Lagrangian, PhasePoint, Scalar};
use discrete_herglotz::{
    DiscreteLagrangian, InputError,
    boundary::{BoundaryPath, CriticalPath, End},
    theory::DiscretePath,
};
use discrete_herglotz::{
    boundary::{PathStatus, branch},
    rules::{Quadrature, Rule},
    solve::Solver,
};

const EPS: f64 = f64::EPSILON;

fn at<const N: usize>(q: [f64; N]) -> End<N> {
    End::Position(q.into())
}

const STEPS: usize = 400;

fn bratu(lambda: f64) -> Result<BoundaryPath<Quadrature<One>, 1>, InputError> {
    BoundaryPath::new(
        Rule::MIDPOINT.of(One::from(Bratu::undamped(lambda)), 1.0 / STEPS as f64)?,
        STEPS,
        [at([0.0]), at([0.0])],
    )
}

/// Close to the fold, where the two solutions are closest, by deflation and by continuation around the fold.
#[test]
fn both_paths_beside_a_fold() {
    for lambda in [1.0, 2.0, 3.0, 3.4, 3.5] {
        let problem = bratu(lambda).unwrap();
        let lower = problem.search();
        let upper = problem.clone().avoiding(&[&lower], 1.0).unwrap().search();
        for (found, index, bracket) in [(&lower, 0, [0.3, 2.399]), (&upper, 1, [2.4, 9.0])] {
            assert_eq!(found.status, PathStatus::Found, "lambda = {lambda}: {}", found.status);
            assert_eq!(problem.index(found).unwrap(), Some(index));
            let (exact, a) = Bratu::maximum(lambda, bracket);
            // The rule has order 2 with a constant that is the fourth derivative, about a^4; near the fold the maximum
            // depends on lambda like `1 / sqrt(3.5138 - lambda)`, which magnifies the error.
            let bound = a.powi(4) / (STEPS * STEPS) as f64 * (1.0 + 1.0 / (3.5138f64 - lambda).sqrt());
            let off = (found.points[STEPS / 2][0] - exact).abs();
            assert!(off <= bound, "lambda = {lambda}: {off:e} of {bound:e}");
        }
        // The branch from one solution leads around the fold to the other.
        let paths = branch(bratu, [lambda, 4.0], 0.2, 200).unwrap();
        let (first, last) = (&paths[0], paths.last().unwrap());
        assert!(first.0 == lambda && last.0 == lambda && paths.iter().all(|(_, path)| path.is_found()));
        let apart = |a: &CriticalPath<1>, b: &CriticalPath<1>| {
            max_abs_or_nan(a.points.iter().zip(&b.points).map(|(a, b)| (a - b).max_abs_or_nan()))
        };
        // Two results of Newton's method: the error of a position in each equation is eps q/h, which the inverse of the
        // equations magnifies by a quarter of the span for each step, and by the nearness of the fold.
        let bound = 4.0 * EPS * 8.0 * (STEPS * STEPS) as f64 / (3.5138f64 - lambda).sqrt();
        assert!(apart(&first.1, &lower) <= bound && apart(&last.1, &upper) <= bound, "{:e}", apart(&last.1, &upper));
        // Along the branch lambda rises to the fold of the rule, at a distance of h^2 from that of the problem, and
        // falls.
        let highest = paths.iter().map(|(lambda, _)| *lambda).fold(0.0, max_or_nan);
        assert!(highest > lambda && highest < 3.513830719 + 10.0 / (STEPS * STEPS) as f64, "{highest}");
        let turns = paths.windows(3).filter(|w| (w[1].0 - w[0].0) * (w[2].0 - w[1].0) < 0.0).count();
        assert_eq!(turns, 1, "{:?}", paths.iter().map(|(lambda, _)| *lambda).collect::<Vec<_>>());
    }
}

const MIXED: usize = 60;
const P0: f64 = 0.3;
const Z0: f64 = 0.4;

/// `L = (v^2 - q^2 - 0.7 z^2)/2`, the momentum given at the start, the position at the end; by the span of time.
fn mixed(span: f64) -> Result<BoundaryPath<Quadrature<One>, 1>, InputError> {
    let ld = Rule::MIDPOINT.of(one(QuadraticInZ { c: 0.7 }), span / MIXED as f64)?;
    BoundaryPath::new(ld, MIXED, [End::Momentum([P0].into()), at([1.0])])?.starting_at(0.0, Z0)
}

/// The distance of the flow from `(q0, P0, Z0)` from the position at the end, without a boundary-value problem. `None`
/// where the motion is not defined up to the end.
fn missed(span: f64, q0: f64) -> Option<f64> {
    let h = span / MIXED as f64;
    let ld = Rule::MIDPOINT.of(one(QuadraticInZ { c: 0.7 }), h).ok()?;
    let mut x = PhasePoint { q: [q0].into(), p: [P0].into(), z: Z0 };
    let (mut v, mut solver) = (x.p, Solver::default());
    for k in 0..MIXED {
        let step = ld.forward(k as f64 * h, &x, &v, &mut solver).ok()?;
        (x, v) = (step.end, step.velocity);
    }
    Some(x.q[0] - 1.0)
}

/// The starts in a range from which the flow meets the end, to a thousandth.
fn shots(span: f64, low: f64, high: f64) -> Vec<f64> {
    let count = ((high - low) * 1000.0) as usize;
    let misses: Vec<_> = (0..=count).map(|k| (low + k as f64 * 1e-3, missed(span, low + k as f64 * 1e-3))).collect();
    let meets = |w: &&[(f64, Option<f64>)]| matches!((w[0].1, w[1].1), (Some(a), Some(b)) if a * b <= 0.0);
    misses.windows(2).filter(meets).map(|w| w[0].0).collect()
}

/// With the momentum given at the start, paths end in a fold at a span between 1.1 and 1.2: above it shooting finds
/// none from starts of size up to 6, and the search ends with a status. Below it there are two, and the branch in the
/// step size leads from one to the other.
#[test]
fn mixed_ends_have_a_fold() {
    for span in [1.2, 1.3] {
        let starts = shots(span, -4.0, 6.0);
        assert!(starts.is_empty(), "{starts:?}");
        let none = mixed(span).unwrap().search();
        // The search stalls with a residual; large corrections may lead it to a distant path, outside of the range of
        // the shooting.
        if none.is_found() {
            assert!(!(-4.0..6.0).contains(&none.points[0][0]), "{}", none.points[0]);
        } else {
            assert!(matches!(none.status, PathStatus::Stalled | PathStatus::NotConverged), "{}", none.status);
            assert!(
                none.points.len() == MIXED + 1 && none.residual > 1e-3 && none.residual < 1.0,
                "{:e}",
                none.residual
            );
        }
    }
    for span in [0.9, 1.0, 1.1] {
        let starts = shots(span, -4.0, 6.0);
        assert_eq!(starts.len(), 2, "{starts:?}");
        let paths = branch(mixed, [span, 2.0], 0.05, 200).unwrap();
        let (first, last) = (&paths[0], paths.last().unwrap());
        assert!(first.0 == span && last.0 == span && paths.iter().all(|(_, path)| path.is_found()), "{}", last.0);
        for ((_, path), start) in [first, last].into_iter().zip(&starts) {
            let q0 = path.points[0][0];
            assert!(q0 >= *start && q0 <= start + 1e-3, "{q0} beside {start}");
            // The flow from there meets the end: an error of q0, about eps q / h for each equation, grows by about
            // `e^span` on this path.
            let off = missed(span, q0).unwrap();
            assert!(off.abs() <= 64.0 * EPS * q0 * (MIXED * MIXED) as f64 / span, "{off:e}");
        }
        let highest = paths.iter().map(|(span, _)| *span).fold(0.0, max_or_nan);
        // The fold is between the spans for which shooting finds two starts and none.
        assert!((1.1..1.2).contains(&highest), "{highest}");
    }
    // From a short span the branch goes around this fold, back, and around another one to the distant path.
    let paths = branch(mixed, [0.6, 1.5], 0.05, 200).unwrap();
    let last = paths.last().unwrap();
    let far = shots(1.5, 8.0, 8.5);
    assert!(far.len() == 1 && last.0 == 1.5 && (last.1.points[0][0] - far[0]).abs() <= 1e-3, "{} {far:?}", last.0);
    let turns = paths.windows(3).filter(|w| (w[1].0 - w[0].0) * (w[2].0 - w[1].0) < 0.0).count();
    assert_eq!(turns, 2);
}

/// The corrections are those of Newton's method, also where forces depend on the action: of a perturbation of 1e-3 they
/// leave 1e-6, 1e-12 and zero, and one more confirms it.
#[test]
fn corrections_converge_quadratically() {
    fn run<const N: usize>(system: impl Lagrangian<N> + Copy, from: [f64; N], to: [f64; N], z0: f64) {
        let steps = 50;
        let ld = Rule::MIDPOINT.of(system, 0.8 / steps as f64).unwrap();
        let momentum = End::Momentum(SVector::from_fn(|i, _| 0.2 + 0.1 * i as f64));
        for ends in [[at(from), at(to)], [momentum, at(to)], [at(from), momentum], [at(from), End::Free]] {
            let problem = || BoundaryPath::new(ld, steps, ends).unwrap().starting_at(0.2, z0).unwrap();
            let found = problem().search();
            assert_eq!(found.status, PathStatus::Found);
            let disturbed = found.points.iter().enumerate().map(|(k, q)| q.map(|c| c + 1e-3 * (0.1 * k as f64).cos()));
            let again = problem().from_path(DiscretePath::new(disturbed.collect()).unwrap()).unwrap().search();
            assert!(again.is_found() && again.iterations <= 4, "{ends:?}: {} after {}", again.status, again.iterations);
        }
    }
    run(one(QuadraticInZ { c: 0.7 }), [0.3], [-0.4], 0.8);
    run(two(CoupledPlane::default()), [0.1, 0.0], [0.3, 0.4], 0.4);
    run(one(Pendulum::default()), [0.1], [0.6], 0.0);
}

/// Two oscillators, with a mass matrix without a diagonal.
#[derive(Clone, Copy, Debug)]
pub struct Crossed;

impl Lagrangian<2> for Crossed {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        v[0] * v[1] - q[0] * q[1] - z * z * 0.0
    }
}

/// Where the mass matrix has no diagonal the elimination exchanges rows of neighbouring points.
#[test]
fn a_mass_without_a_diagonal() {
    let (h, steps) = (0.02, 100);
    let ld = Rule::MIDPOINT.of(Two::from(Crossed), h).unwrap();
    let found = BoundaryPath::new(ld, steps, [at([0.3, -0.2]), at([1.0, 0.4])]).unwrap().search();
    assert_eq!(found.status, PathStatus::Found, "{}", found.status);
    // Both coordinates are oscillators, with the angle `2 atan(h/2)` of the rule: each agrees with a single oscillator.
    let one = Rule::MIDPOINT.of(one(HarmonicOscillator { gamma: 0.0 }), h).unwrap();
    for i in 0..2 {
        let ends = [at([[0.3, -0.2][i]]), at([[1.0, 0.4][i]])];
        let alone = BoundaryPath::new(one, steps, ends).unwrap().search();
        for (a, b) in alone.points.iter().zip(&found.points) {
            // An error of eps q/h in each equation, through an inverse of about a quarter of the span for each step.
            assert!((a[0] - b[i]).abs() <= 4.0 * EPS * (steps * steps) as f64 / 4.0, "{:e}", a[0] - b[i]);
        }
    }
}

/// A path that does not fit in memory is refused before it is computed, and the parameters of branches are checked.
#[test]
fn bad_input_is_refused() {
    let ld = Rule::MIDPOINT.of(one(Pendulum::default()), 0.1).unwrap();
    let ends = [at([0.0]), at([1.0])];
    for steps in [1_000_000_000_000, usize::MAX / 2, usize::MAX] {
        for refused in [BoundaryPath::new(ld, steps, ends), BoundaryPath::periodic(ld, steps, [0.0].into())] {
            let Err(InputError::TooMany { found, most, .. }) = refused else { panic!("{steps} steps are taken") };
            assert!(found == steps as f64 && most < found && most > 1e4, "{most}");
        }
    }
    assert!(BoundaryPath::new(ld, 1_000_000, ends).is_ok());
    let none = |range, step, most| branch(bratu, range, step, most).unwrap_err();
    assert!(matches!(none([f64::NAN, 4.0], 0.1, 10), InputError::Geometry(_)));
    assert!(matches!(none([3.0, 3.0], 0.1, 10), InputError::Span { .. }));
    for step in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        assert!(matches!(none([3.0, 4.0], step, 10), InputError::Step { .. }));
    }
    assert!(matches!(none([3.0, 4.0], 0.1, 1), InputError::Count { least: 2, found: 1, .. }));
    // The number of steps may not change along a branch.
    let changing = |n: f64| BoundaryPath::new(ld, n as usize, ends);
    assert!(matches!(branch(changing, [10.0, 20.0], 1.0, 10), Err(InputError::PathLength { expected: 10, .. })));
    // Where the first path does not exist, the branch consists of it alone, with its status.
    let paths = branch(bratu, [4.0, 3.0], 0.1, 10).unwrap();
    assert!(paths.len() == 1 && !paths[0].1.is_found());
}
