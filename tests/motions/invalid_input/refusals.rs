//! Invalid input is a typed error before the first step; a failure later is a status that keeps what was computed.

use crate::common::lagrangians::{Bratu, Massless};
use crate::invalid_input::sentences::input::Odd;
use crate::lagrangians::{One, one};
use contact_examples::systems::{FreeParticle, Pendulum};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, GeometryError, Lagrangian, PhasePoint, Scalar, VelocityPoint};
use discrete_herglotz::{
    AnyIntegrator, DiscreteLagrangian, InputError, Outcome, Problem, Row, Rows, Status, StepError, Steps, Until,
    rules::{Flow, Method, Rule},
};
use exact_lagrangian::{
    ContactExponential, ExactError, ExactLagrangian, compose, error_orders,
    principle::{Curve, SplineCurve},
};

/// Equal points are invalid only where a discrete Lagrangian is singular on the diagonal.
#[test]
fn equal_points() {
    let ld = Rule::RECTANGLE.of(one(FreeParticle::default()), 0.1).unwrap();
    assert!(Flow::from_points(&ld, 0.0, DiscretePoint::new([0.3], [0.3], 0.0)).is_ok());
}

/// A run of a rule by a number of steps of a size from t = 0, with a row of each.
fn every_step(lagrangian: &One, start: PhasePoint<1>, method: Method, (h, steps): (f64, usize)) -> (Outcome, Vec<Row>) {
    let problem = Problem::new(lagrangian, 0.0, start).unwrap();
    let mut rows = Rows::every(1).unwrap();
    let run = problem.by(AnyIntegrator::Discrete(method)).steps(Steps::Size(h)).observe(&mut rows);
    let outcome = run.run(Until::Steps(steps)).unwrap();
    (outcome, rows.rows)
}

fn all_finite(rows: &[Row]) -> bool {
    rows.iter().all(|row| [row.t, row.q[0], row.p[0], row.z.unwrap_or(f64::NAN)].iter().all(|x| x.is_finite()))
}

/// A drag that grows with time.
#[derive(Clone, Copy, Debug)]
pub struct GrowingDrag;

impl Lagrangian<1> for GrowingDrag {
    fn value<T: Scalar>(&self, t: T, _q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 - t * z
    }
}

/// Where sigma_d crosses zero during a run, the status has the step, and every row before it is kept.
#[test]
fn sigma_crosses_zero() {
    // sigma = 1 - h t_mid with t_mid = (k + 1/2) h: not positive from k = 100 on, for h = 0.1.
    let start = PhasePoint::new([0.0], [1.0], 0.0);
    let (Outcome { status, t, .. }, rows) =
        every_step(&One::from(GrowingDrag), start, Method::LeftMidpoint, (0.1, 200));
    let failed =
        matches!(status, Status::Failed { step: 100, cause: StepError::SigmaVanished { .. }, t: at } if at == t);
    assert!(failed, "{status:?}");
    assert_eq!((rows.len(), rows[100].t), (101, t));
    assert!(all_finite(&rows));
}

/// Motion that blows up ends with a status and not with a NaN: `z' = z^2` has a pole at t = 1.
#[test]
fn blow_up() {
    let start = PhasePoint::new([0.0], [0.1], 1.0);
    // A rule that is explicit in z, and one that is implicit.
    for method in [Method::LeftMidpoint, Method::Midpoint] {
        let (Outcome { status, .. }, rows) = every_step(&One::from(Odd::Explosive), start, method, (0.01, 400));
        let failed = matches!(status, Status::Failed { step, .. } if step + 1 == rows.len());
        assert!(failed, "{status:?} with {} rows", rows.len());
        assert!(all_finite(&rows));
    }
}

/// The exact flow and retraction: steps, points, a singular W, equal points.
#[test]
fn exact_input() {
    for h in [0.0, -0.5, f64::INFINITY] {
        assert_eq!(ExactLagrangian::<_, 1>::new(one(Pendulum::default()), h).err(), Some(InputError::Step { h }));
        assert_eq!(ContactExponential::new(one(Pendulum::default()), h).err(), Some(InputError::Step { h }));
        let orders = error_orders(
            &one(Pendulum::default()),
            |h| Rule::MIDPOINT.of(one(Pendulum::default()), h),
            0.0,
            &VelocityPoint::new([1.0], [0.5], 0.0),
            h,
        );
        assert_eq!(orders.err(), Some(ExactError::Input(InputError::Step { h })));
    }
    let exp = ContactExponential::new(one(Pendulum::default()), 0.5).unwrap();
    let bad = exp.retract(0.0, &DiscretePoint::new([0.1], [f64::NAN], 0.0));
    assert!(matches!(bad, Err(ExactError::Input(InputError::Geometry(GeometryError::NonFinite { what: "q1", .. })))));
    let exp = ContactExponential::new(Massless, 0.5).unwrap();
    let singular = exp.retract(0.0, &DiscretePoint::new([0.1], [0.2], 0.0));
    let ok = matches!(singular, Err(ExactError::Input(InputError::Geometry(GeometryError::Singular { .. }))));
    assert!(ok, "{singular:?}");
    // Equal points are valid: the pendulum at rest joins them.
    let exp = ContactExponential::new(one(Pendulum::default()), 0.5).unwrap();
    assert!(exp.retract(0.0, &DiscretePoint::new([0.0], [0.0], 0.0)).is_ok_and(|r| r.start.v[0] == 0.0));
}

/// Where no motion joins the points, the error has the last motion tried, its residual and a singular value, which are
/// finite.
#[test]
fn no_motion_between_points() {
    // Beyond h^2 = 3.5/6 no motion joins points near 0.
    let exp = ContactExponential::new(Bratu { lambda: 6.0, drag: 0.01 }, 4.0).unwrap();
    let x = DiscretePoint::new([0.0], [0.1], 0.0);
    match exp.retract(0.0, &x) {
        Err(
            ExactError::NotConverged { last, residual, smallest }
            | ExactError::ConjugatePoint { last, residual, smallest },
        ) => {
            assert!(
                last.check().is_ok() && residual > 1e-9 && smallest.is_finite(),
                "{last:?}, {residual}, {smallest}"
            );
        }
        Err(ExactError::OutsideDomain { reached, .. }) => assert!(reached.check().is_ok()),
        other => unreachable!("{other:?}"),
    }
}

/// Splines: too few nodes, lists of unequal length, times that do not increase or are not finite; and times outside of
/// the nodes.
#[test]
fn splines() {
    let points = [0.0, 1.0, 0.5].map(|q| SVector::from([q]));
    let of = |times: &[f64], points: &[SVector<f64, 1>]| SplineCurve::new(times, points, None);
    assert!(matches!(of(&[0.0, 1.0], &points[..2]), Err(InputError::Count { least: 3, found: 2, .. })));
    let short = of(&[0.0, 1.0, 2.0], &points[..2]).err();
    assert!(matches!(short, Some(InputError::Geometry(GeometryError::WrongSize { expected: 3, found: 2, .. }))));
    assert!(of(&[0.0, 1.0, 1.0], &points).is_err() && of(&[0.0, f64::NAN, 1.0], &points).is_err());
    let curve = of(&[0.0, 1.0, 2.0], &points).unwrap();
    assert!(curve.at(1.5).is_ok() && curve.at(2.5).is_err() && curve.at(f64::NAN).is_err());
}

/// A composition without a critical point is refused.
#[test]
fn no_critical_point() {
    struct Flat;
    impl DiscreteLagrangian<1> for Flat {
        fn step_size(&self) -> f64 {
            0.1
        }
        fn value<T: Scalar>(&self, _t: f64, x: &DiscretePoint<1, T>) -> Result<T, StepError> {
            Ok(x.q1[0] - x.q0[0] * 2.0)
        }
    }
    let ends = [SVector::from([0.0]), SVector::from([1.0])];
    let refused = compose(&Flat, &Flat, 0.0, (&ends, 0.0), &SVector::from([0.4]));
    assert!(matches!(refused, Err(StepError::Singular { .. })), "{refused:?}");
}
