//! Momenta and free ends, periodic paths, and invalid problems.

use super::{EPS, at, by, check, largest_of};
use crate::lagrangians::{One, SwitchingOne, Two, one};
use crate::resets::Floor;
use contact_examples::systems::{Duffing, FreeParticle, Pendulum, QuadraticInZ, Relativistic, UniformField};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::MaxAbsOrNan;
use contact_geom::switching::{Impact, Impacts};
use contact_geom::{DiscretePoint, GeometryError, Lagrangian, Scalar};
use discrete_herglotz::boundary::{BoundaryPath, CriticalPath, End, PathStatus};
use discrete_herglotz::rules::{Method, Rule};
use discrete_herglotz::theory::{DiscretePath, discrete_flow, legendre_minus, legendre_plus};
use discrete_herglotz::{DiscreteLagrangian, InputError, StepError};
use std::f64::consts::PI;

/// Momenta at one end, at both, and free ends: the momenta are those of the discrete Legendre transforms, and a free
/// end is critical.
#[test]
fn momenta_and_free_ends() {
    let (h, steps, z0) = (0.01, 60, 0.4);
    let ld = Rule::MIDPOINT.of(one(QuadraticInZ { c: 0.7 }), h).unwrap();
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
    let ld = Rule::MIDPOINT.of(one(system), 2.0 * PI / 1.2 / steps as f64).unwrap();
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
    assert!((x.q0 - found.points[0]).max_abs_or_nan() <= 1e-10, "{} {}", x.q0, found.points[0]);

    // Two coordinates, one of them never at rest.
    let ld = Rule::MIDPOINT.of(Two::from(Driven), 0.05).unwrap();
    let found = BoundaryPath::periodic(&ld, 60, [0.0, 0.0].into()).unwrap().starting_at(0.0, 0.2).unwrap().search();
    closes(&ld, 0.2, &found, [0.0, 0.0]);
    // Forces that depend on the action, and different positions at the ends.
    let ld = Rule::MIDPOINT.of(one(QuadraticInZ::default()), 0.1).unwrap();
    let found = BoundaryPath::periodic(&ld, 30, [1.0].into()).unwrap().starting_at(0.0, 0.3).unwrap().search();
    closes(&ld, 0.3, &found, [1.0]);
}

pub fn closes<D: DiscreteLagrangian<N>, const N: usize>(ld: &D, z0: f64, found: &CriticalPath<N>, shift: [f64; N]) {
    check(ld, (0.0, z0), found, 1.0);
    let steps = found.points.len() - 1;
    let point = |k: usize| DiscretePoint { q0: found.points[k], q1: found.points[k + 1], z0: found.actions[k] };
    let start = legendre_minus(ld, 0.0, &point(0)).unwrap();
    let end = legendre_plus(ld, ld.step_size() * (steps - 1) as f64, &point(steps - 1)).unwrap();
    let q = largest_of(&found.points);
    assert!((found.points[steps] - found.points[0] - SVector::from(shift)).max_abs_or_nan() <= 4.0 * EPS * q);
    // The rounding of a position changes a momentum by W/h times the rounding.
    assert!((start.p - end.p).max_abs_or_nan() <= 32.0 * EPS * q / ld.step_size(), "{} {}", start.p, end.p);
}

/// A pendulum with a torque and an oscillator, forced with the period 3, with a drag that depends on the action.
#[derive(Clone, Copy, Debug)]
pub struct Driven;

impl Lagrangian<2> for Driven {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let force = (t * (2.0 * PI / 3.0)).cos() * 0.2;
        let potential = q[0].cos() * 0.8 - q[1] * q[1] * 0.4 + q[0].sin() * q[1] * 0.3;
        (v[0] * v[0] + v[1] * v[1]) * 0.5 + potential + force * q[1] + q[0] * 0.1 - z * z * 0.01
    }
}

/// Positions outside of the domain, and a conformal factor that is not positive, are reported as a status.
#[test]
fn undefined_paths_are_a_status() {
    // A velocity above the speed of light.
    let ld = Rule::MIDPOINT.of(one(Relativistic::default()), 0.1).unwrap();
    let found = BoundaryPath::new(&ld, 10, [at([0.0]), at([5.0])]).unwrap().search();
    let StepError::NonFinite = (match found.status {
        PathStatus::Undefined { step: 0, cause } => cause,
        status => panic!("{status}"),
    }) else {
        panic!("{}", found.status)
    };
    assert!(found.points.len() == 11 && found.residual == f64::INFINITY);
    // 1 + h gamma < 0 for the rule that is explicit in z.
    let ld = by(Method::LeftMidpoint, one(FreeParticle { gamma: -3.0 }), 0.5);
    let found = BoundaryPath::new(&ld, 4, [at([0.0]), at([1.0])]).unwrap().search();
    assert!(matches!(found.status, PathStatus::SigmaVanished { step: 0, sigma } if sigma == -0.5), "{}", found.status);
}

/// A path knows no impacts: it passes through the surface, here below the ground.
#[test]
fn paths_pass_through_surfaces() {
    let field = UniformField::<1> { field: [1.0], gamma: -0.1 };
    let ball = SwitchingOne::from(Impacts::new(field, Floor, Impact::Elastic));
    let ends = [at([0.1]), at([0.1])];
    let found = BoundaryPath::new(Rule::MIDPOINT.of(ball, 0.1).unwrap(), 20, ends).unwrap().search();
    let free = BoundaryPath::new(&Rule::MIDPOINT.of(One::from(field), 0.1).unwrap(), 20, ends).unwrap().search();
    assert!(found.is_found() && found.points == free.points && found.points[10][0] < 0.0, "{}", found.points[10]);
}

#[test]
fn bad_input_is_refused() {
    let ld = Rule::MIDPOINT.of(one(Pendulum::default()), 0.1).unwrap();
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
