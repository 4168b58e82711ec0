//! Gradients of the members of an ensemble: those of single runs, bitwise, for any number of threads.

use contact_examples::systems::{Duffing, Kepler, OneCoordinate, Pendulum, System};
use contact_geom::{Scalar, VelocityPoint};
use discrete_herglotz::ensemble::EnsembleError;
use discrete_herglotz::sensitivity::{
    BatchGradient, EndCovector, EndState, Loss, MotionState, SensitivityError, Variable,
};
use discrete_herglotz::{
    AnyIntegrator, Ensemble, GaussCollocation, InputError, Problem, SplittingScheme, Status, Steps, TransformedGauss,
    Until,
};

struct Mixed;

impl<const N: usize> Loss<N> for Mixed {
    fn value<T: Scalar>(&self, end: &EndState<N, T>) -> T {
        end.q[0] * end.v[0] + end.p.dot(&end.p) + end.z.sin() * 0.5
    }
}

const UNTIL: Until = Until::Time(3.0);

fn start(i: usize) -> VelocityPoint<1> {
    VelocityPoint::new([0.1 + 0.07 * i as f64], [0.5 - 0.03 * i as f64], 0.01 * i as f64)
}

/// Each member has the gradient of its own run, and the total is the sum in the order of the members.
#[test]
fn members_are_single_runs_for_any_number_of_threads() {
    let pendulum = OneCoordinate::from(Pendulum { gamma: -0.1 });
    let methods = ["gauss_4", "strang", "blanes_moan_6", "midpoint", "trapezoidal"];
    for method in methods.map(|name| name.parse::<AnyIntegrator>().unwrap()) {
        let of = |threads: usize| -> BatchGradient {
            let ensemble = Ensemble::new(&pendulum, 0.0, 37, start).by(method).steps(Steps::Size(0.1)).threads(threads);
            ensemble.gradient(&Mixed, UNTIL).unwrap()
        };
        let batch = of(1);
        assert_eq!(batch.members.len(), 37);
        let mut total = (0.0, 0.0);
        for (i, member) in batch.members.iter().enumerate() {
            let problem = Problem::new(&pendulum, 0.0, start(i)).unwrap();
            let single = problem.by(method).steps(Steps::Size(0.1)).gradient(&Mixed, UNTIL);
            assert_eq!(member, &single, "{method}, member {i}");
            let (value, gradient) = single.unwrap().loss.unwrap();
            total = (total.0 + value, total.1 + gradient.parameters[0]);
        }
        assert_eq!(batch.total(), Some((total.0, vec![total.1])), "{method}");
        assert_eq!(batch.failed().count(), 0);
        for threads in [2, 3, 50] {
            assert_eq!(of(threads), batch, "{method}, {threads} threads");
        }
    }
}

/// The derivative of the total in a shared parameter is that of sums of losses of runs. Losses depend on gamma as
/// `exp(2 gamma T)`, so that central differences of sixth order at the distance d are off by `(2 T d)^6` of the derivative,
/// 5e-14 for d = 1e-3, and by round-off of `eps/d`, 1e-12 with that of the runs.
#[test]
fn the_total_is_differentiated() {
    let total = |gamma: f64| {
        let pendulum = OneCoordinate::from(Pendulum { gamma });
        let ensemble = Ensemble::new(&pendulum, 0.0, 20, start).by(GaussCollocation { stages: 6 });
        ensemble.steps(Steps::Size(0.25)).gradient(&Mixed, UNTIL).unwrap().total().unwrap()
    };
    let (d, gamma) = (1e-3, -0.1);
    let pair = |k: f64| (total(gamma + k * d).0 - total(gamma - k * d).0) / d;
    let expected = 0.75 * pair(1.0) - 0.15 * pair(2.0) + pair(3.0) / 60.0;
    let found = total(gamma).1[0];
    assert!((found - expected).abs() <= 1e-10 * expected.abs(), "{found} and {expected}");
}

/// Members with Lagrangians of their own, and steps that are chosen for an accuracy: for each member by itself.
#[test]
fn a_study_of_parameters() {
    let many: Vec<OneCoordinate> = (0..9).map(|i| Pendulum { gamma: -0.02 * i as f64 }.into()).collect();
    let ensemble = Ensemble::of(0.0, many.len(), |i| (&many[i], start(i))).accuracy(1e-8).threads(2);
    let batch = ensemble.gradient(&Mixed, UNTIL).unwrap();
    for (i, member) in batch.members.iter().enumerate() {
        let problem = Problem::new(&many[i], 0.0, start(i)).unwrap();
        let single = problem.by(GaussCollocation { stages: 8 }).accuracy(1e-8).gradient(&Mixed, UNTIL);
        assert_eq!(member, &single, "member {i}");
    }
}

/// A loss of rows that depends on the member, and the tangents of the same rows.
#[test]
fn rows_and_tangents() {
    let system = OneCoordinate::from(Duffing::forced());
    let t0 = system.initial_time();
    let times = [t0, t0 + 0.33, t0 + 1.0, t0 + 2.0];
    let ensemble = Ensemble::new(&system, t0, 12, start).by(SplittingScheme::BLANES_MOAN_6).steps(Steps::Size(0.1));
    let weight = |i: usize, k: usize| 1.0 + 0.1 * i as f64 - 0.2 * k as f64;
    let loss = |i: usize, states: &[MotionState]| {
        let value = states.iter().enumerate().map(|(k, state)| weight(i, k) * (state.q[0] + state.z)).sum();
        let covector = |k| EndCovector { q: [weight(i, k)].into(), z: weight(i, k), ..EndCovector::zero(1) };
        (value, (0..states.len()).map(covector).collect())
    };
    let until = Until::Time(t0 + 2.0);
    let batch = ensemble.gradient_at(&times, loss, until).unwrap();
    let variables = [Variable::Position(0), Variable::Velocity(0), Variable::Action];
    let tangents = ensemble.tangent_at(&variables, &times, until).unwrap();
    for (i, (member, tangent)) in batch.members.iter().zip(&tangents).enumerate() {
        let (gradient, tangent) = (&member.as_ref().unwrap().loss.as_ref().unwrap().1, tangent.as_ref().unwrap());
        for (j, found) in [gradient.q[0], gradient.rate[0], gradient.z].into_iter().enumerate() {
            let of = |(k, row): (usize, &discrete_herglotz::sensitivity::TangentRow)| {
                weight(i, k) * (row.columns[j].q[0] + row.columns[j].z)
            };
            let expected: f64 = tangent.rows.iter().enumerate().map(of).sum();
            assert!((found - expected).abs() <= 1e-12 * (1.0 + expected.abs()), "{i}, {j}: {found} and {expected}");
        }
    }
}

/// A member that falls into the centre, and one that cannot start, have a status or an error, and no gradient; the others have
/// theirs.
#[test]
fn members_that_fail() {
    let kepler = Kepler::<2>::default();
    let of = |i: usize| match i {
        // At rest close to the centre.
        3 => VelocityPoint::new([1e-3, 0.0], [0.0, 0.0], 0.0),
        5 => VelocityPoint::new([f64::NAN, 0.0], [0.0, 1.0], 0.0),
        _ => VelocityPoint { q: kepler.initial().q * (1.0 + 0.01 * i as f64), ..kepler.initial() },
    };
    let ensemble = Ensemble::new(&kepler, 0.0, 8, of).by(GaussCollocation { stages: 4 }).steps(Steps::Size(0.05));
    let batch = ensemble.gradient(&Mixed, UNTIL).unwrap();
    assert_eq!(batch.total(), None);
    assert_eq!(batch.failed().map(|(i, _)| i).collect::<Vec<_>>(), [3, 5]);
    let failed = batch.members[3].as_ref().unwrap();
    assert!(failed.loss.is_none() && !matches!(failed.outcome.status, Status::Completed), "{failed:?}");
    // The texts are compared, since a NaN differs from itself.
    let refused = Problem::new(&kepler, 0.0, of(5)).map(|_| ()).unwrap_err();
    let said = batch.members[5].as_ref().unwrap_err();
    assert!(matches!(said, SensitivityError::Input(_)) && said.to_string() == refused.to_string(), "{said}");
}

#[test]
fn invalid_input() {
    let pendulum = OneCoordinate::from(Pendulum::default());
    let of = |count| Ensemble::new(&pendulum, 0.0, count, start);
    let gauss = GaussCollocation { stages: 4 };
    let ready = |count| of(count).by(gauss).steps(Steps::Size(0.1));
    assert!(matches!(ready(0).gradient(&Mixed, UNTIL), Err(EnsembleError::Empty)));
    assert!(matches!(ready(2).threads(0).gradient(&Mixed, UNTIL), Err(EnsembleError::Threads)));
    let refused = |found: Result<BatchGradient, EnsembleError>| match found {
        Err(EnsembleError::Member { index: 0, cause }) => cause,
        found => panic!("{found:?}"),
    };
    assert_eq!(refused(of(2).steps(Steps::Size(0.1)).gradient(&Mixed, UNTIL)), InputError::NoIntegrator);
    assert_eq!(refused(of(2).by(gauss).gradient(&Mixed, UNTIL)), InputError::NoSteps);
    // What concerns a run is reported by each member.
    let undefined = ready(2).gradient_of(|_, _| (f64::NAN, EndCovector::zero(1)), UNTIL).unwrap();
    assert!(undefined.members.iter().all(|member| matches!(member, Err(SensitivityError::Loss { .. }))));
    let outside = ready(2).gradient_at(&[5.0], |_, _| (0.0, vec![EndCovector::zero(1)]), UNTIL).unwrap();
    assert!(outside.members.iter().all(|member| matches!(member, Err(SensitivityError::Input(_)))), "{outside:?}");
    let unknown = ready(2).tangent_at(&[Variable::Parameter("gama".into())], &[], UNTIL).unwrap();
    assert!(unknown.iter().all(|member| matches!(member, Err(SensitivityError::Parameter(_)))));
    let kepler = Kepler::<2>::default();
    let ensemble = Ensemble::new(&kepler, 0.0, 2, |_| kepler.initial()).by(TransformedGauss { stages: 6 });
    let found = ensemble.steps(Steps::Size(0.2)).gradient(&Mixed, Until::Time(1.0)).unwrap();
    assert!(found.members.iter().all(|member| matches!(member, Err(SensitivityError::NoTangent { .. }))));
}
