//! The exact discrete Lagrangian in the discrete Herglotz principle: the points of a critical path lie on one exact
//! motion.

use crate::lagrangians::{one, two};
use contact_examples::systems::{CoupledInZ, CoupledPlane, QuadraticInZ};
use contact_geom::numbers::{MaxAbsOrNan, MaxOrNan, max_or_nan};
use contact_geom::{Lagrangian, VelocityPoint, legendre};
use discrete_herglotz::{
    DiscreteLagrangian,
    boundary::{BoundaryPath, End},
    theory::DiscretePath,
};
use exact_lagrangian::{ExactLagrangian, Motion, herglotz_flow};

const EPS: f64 = f64::EPSILON;

/// Critical paths between the ends of an exact motion, with its position or its momentum given at each end, are that
/// motion: their positions and actions at each point, and the conformal factor.
fn returns_the_motion<const N: usize>(
    system: &impl Lagrangian<N>,
    t0: f64,
    start: &VelocityPoint<N>,
    steps: usize,
    span: f64,
) {
    let h = span / steps as f64;
    let motion = |t: f64| -> Motion<N> { herglotz_flow(system, t0, start, t).unwrap() };
    let truth: Vec<_> = (1..=steps).map(|k| motion(k as f64 * h)).collect();
    let last = &truth[steps - 1];
    let (p0, p1) = (legendre(system, t0, start).p, legendre(system, t0 + span, &last.end).p);
    let largest_position = truth.iter().map(|m| m.end.q.max_abs_or_nan()).fold(start.q.max_abs_or_nan(), max_or_nan);
    // A momentum is accurate to eps times itself and eps times `W q/h`, the effect of the rounding of a position. The
    // residuals of all points accumulate over the span, each as an impulse that displaces the points after it by up to
    // the span. W is about one here.
    let momentum = largest_position / h + p0.max_abs_or_nan() + p1.max_abs_or_nan();
    let bound = 4.0 * EPS * momentum * steps as f64 * span;

    let ld = ExactLagrangian::<_, N>::new(system, h).unwrap();
    let position = [End::Position(start.q), End::Position(last.end.q)];
    let mixed = [[End::Momentum(p0), position[1]], [position[0], End::Momentum(p1)]];
    for ends in [position, mixed[0], mixed[1]] {
        let mut problem = BoundaryPath::new(&ld, steps, ends).unwrap().starting_at(t0, start.z).unwrap();
        if ends != position {
            // With a given momentum there are other paths as well: this one is found from a perturbed motion, others
            // from the straight line.
            let points = std::iter::once(&start.q).chain(truth.iter().map(|m| &m.end.q));
            let disturbed = points.enumerate().map(|(k, q)| q.map(|c| c + 1e-2 * (k as f64).cos())).collect();
            problem = problem.from_path(DiscretePath::new(disturbed).unwrap()).unwrap();
        }
        let found = problem.search();
        assert!(found.is_found(), "{ends:?}: {}", found.status);
        assert!((found.points[0] - start.q).max_abs_or_nan() <= bound, "{} of {bound:e}", found.points[0] - start.q);
        for (k, m) in truth.iter().enumerate() {
            let off = (found.points[k + 1] - m.end.q).max_abs_or_nan();
            assert!(off <= bound, "{ends:?}, point {}: {off:e} of {bound:e}", k + 1);
            // The action varies by `p dq` at the ends of the path, up to factors of about one by the drag.
            let off = (found.actions[k + 1] - m.end.z).abs();
            assert!(off <= bound * momentum.max_or_nan(1.0), "{ends:?}, action {}: {off:e} of {bound:e}", k + 1);
        }
        // `sigma_1 ... sigma_N = e^b`, with `b = int L_z` over the whole motion.
        assert!((found.log_factor - last.b).abs() <= bound, "{:e} of {bound:e}", found.log_factor - last.b);
        // The momenta of F-L_h^e and F+L_h^e are those of the motion.
        let x = |k: usize| contact_geom::DiscretePoint {
            q0: found.points[k],
            q1: found.points[k + 1],
            z0: found.actions[k],
        };
        let (first, end) = (ld.jet(t0, &x(0)).unwrap(), ld.jet(t0 + span - h, &x(steps - 1)).unwrap());
        let off = (first.d1 / -first.sigma() - p0).max_abs_or_nan().max_or_nan((end.d2 - p1).max_abs_or_nan());
        assert!(off <= bound / h, "{off:e} of {:e}", bound / h);
    }
}

/// Systems that are nonlinear in q and z: an inertia that depends on all of `(q, v, z)`, a term quadratic in the
/// action, and two coordinates.
#[test]
fn paths_of_the_exact_lagrangian_are_exact_motions() {
    let (coupled, quadratic) = (one(CoupledInZ::default()), one(QuadraticInZ { c: 0.7 }));
    let plane = two(CoupledPlane::default());
    for (steps, span) in [(2, 0.8), (5, 0.8), (12, 1.2)] {
        returns_the_motion(&coupled, 0.0, &VelocityPoint::new([0.3], [0.9], 0.2), steps, span);
        returns_the_motion(&quadratic, 0.0, &VelocityPoint::new([0.3], [-0.6], 0.8), steps, span);
        returns_the_motion(&plane, 0.3, &VelocityPoint::new([0.2, -0.1], [0.5, 0.4], 0.2), steps, span);
    }
}

/// The points of a path do not depend on their number: the points of each path are among those of every finer one.
#[test]
fn a_finer_path_has_the_same_points() {
    let (system, ends) = (one(CoupledInZ::default()), [End::Position([0.3].into()), End::Position([1.1].into())]);
    let path = |steps: usize| {
        let ld = ExactLagrangian::<_, 1>::new(&system, 1.0 / steps as f64).unwrap();
        let found = BoundaryPath::new(ld, steps, ends).unwrap().starting_at(0.0, 0.4).unwrap().search();
        assert!(found.is_found(), "{}", found.status);
        found
    };
    let fine = path(16);
    for every in [2, 4, 8] {
        let coarse = path(16 / every);
        for (k, q) in coarse.points.iter().enumerate() {
            // As above: sixteen steps, positions and momenta of about one, a span of one.
            let bound = 4.0 * EPS * 16.0 * 16.0;
            assert!(
                (q - fine.points[k * every]).max_abs_or_nan() <= bound,
                "{:e}",
                (q - fine.points[k * every]).max_abs_or_nan()
            );
            assert!((coarse.actions[k] - fine.actions[k * every]).abs() <= bound);
        }
    }
}
