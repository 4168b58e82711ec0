//! Losses of the end and of rows.

use contact_examples::systems::{CoupledPlane, DoublePendulum, OneCoordinate, Pendulum, System, TwoCoordinates};
use contact_geom::{Parametric, Scalar, VelocityPoint};
use discrete_herglotz::sensitivity::{EndCovector, EndState, Gradient, Loss, MotionState, Variable};
use discrete_herglotz::{GaussCollocation, Problem, Status, Steps, Until};

/// A function of the whole end state.
struct Mixed;

impl Loss<2> for Mixed {
    fn value<T: Scalar>(&self, end: &EndState<2, T>) -> T {
        end.q[0] * end.v[1] + end.p.dot(&end.v) * end.z.sin() + end.t * end.q[1]
    }
}

fn all(gradient: &Gradient) -> Vec<f64> {
    let Gradient { q, rate, z, parameters, t0, t_end, .. } = gradient;
    q.iter().chain(rate).chain([z]).chain(parameters).chain([t0, t_end]).copied().collect()
}

/// The gradient of a loss is the sum of its partial derivatives times the columns of the tangent.
#[test]
fn a_loss_of_the_end() {
    let system = TwoCoordinates::from(DoublePendulum::default());
    let problem = Problem::new(&system, 0.2, system.initial()).unwrap();
    let run = || problem.by(GaussCollocation { stages: 8 }).steps(Steps::Count(20));
    let found = run().gradient(&Mixed, Until::Time(2.0)).unwrap();
    let (value, gradient) = found.loss.unwrap();
    let outcome = found.outcome;
    let end = MotionState { t: outcome.t, q: outcome.q, v: outcome.v.unwrap(), p: outcome.p, z: outcome.z.unwrap() };
    let (expected, EndCovector { t, q, v, p, z }) = end.differentiate(&Mixed);
    assert_eq!(value, expected);
    let tangent = run().tangent(&Variable::all(&problem), Until::Time(2.0)).unwrap();
    for (i, (found, column)) in all(&gradient).into_iter().zip(&tangent.columns).enumerate() {
        let last = i + 1 == tangent.columns.len();
        let time = if last { t } else { 0.0 };
        let expected = q.dot(&column.q) + v.dot(&column.v) + p.dot(&column.p) + z * column.z + time;
        assert!((found - expected).abs() <= 1e-12 * (1.0 + expected.abs()), "variable {i}: {found} and {expected}");
    }
}

/// Rows at step ends, within steps, at the start and at the end: the gradient of a sum over rows is that of the tangents
/// of the rows, and these are derivatives of runs that end there.
#[test]
fn losses_of_rows() {
    let system = TwoCoordinates::from(CoupledPlane::default());
    let problem = Problem::new(&system, 0.0, system.initial()).unwrap();
    let run = || problem.by(GaussCollocation { stages: 6 }).steps(Steps::Count(100));
    let times = [0.0, 0.03, 0.1, 0.333, 1.0, 1.7125, 4.999, 5.0];
    let variables = Variable::all(&problem);
    let tangent = run().tangent_at(&variables, &times, Until::Time(5.0)).unwrap();
    assert_eq!(tangent.rows.iter().map(|row| row.state.t).collect::<Vec<_>>(), times);
    let weight = |i: usize| 1.0 + 0.3 * i as f64;
    let loss = |states: &[MotionState]| {
        let of = |(i, state): (usize, &MotionState)| weight(i) * (state.q[0] * state.v[1] + state.z * state.p[0]);
        let covector = |(i, state): (usize, &MotionState)| {
            let mut covector = EndCovector::zero(2);
            covector.q[0] = weight(i) * state.v[1];
            covector.v[1] = weight(i) * state.q[0];
            covector.z = weight(i) * state.p[0];
            covector.p[0] = weight(i) * state.z;
            covector
        };
        (states.iter().enumerate().map(of).sum(), states.iter().enumerate().map(covector).collect())
    };
    let found = run().gradient_at(&times, loss, Until::Time(5.0)).unwrap();
    let gradient = all(&found.loss.unwrap().1);
    for (k, found) in gradient.into_iter().enumerate() {
        let of = |(i, row): (usize, &discrete_herglotz::sensitivity::TangentRow)| {
            let (state, column) = (&row.state, &row.columns[k]);
            let of_products = column.q[0] * state.v[1] + state.q[0] * column.v[1];
            weight(i) * (of_products + column.z * state.p[0] + state.z * column.p[0])
        };
        let expected: f64 = tangent.rows.iter().enumerate().map(of).sum();
        assert!((found - expected).abs() <= 1e-11 * (1.0 + expected.abs()), "{:?}: {found}, {expected}", variables[k]);
    }
    // The derivative of a row in the start is that of a run that ends at its time, up to the errors of both runs.
    for row in &tangent.rows[1..] {
        let short = problem.by(GaussCollocation { stages: 6 }).steps(Steps::Count(100));
        let short = short.tangent(&variables, Until::Time(row.state.t)).unwrap();
        for (a, b) in row.columns.iter().zip(&short.columns).take(8) {
            assert!(
                (&a.q - &b.q).norm() + (&a.v - &b.v).norm() + (a.z - b.z).abs() <= 1e-11,
                "t = {}: {a:?}, {b:?}",
                row.state.t
            );
        }
    }
}

/// A run whose stages are kept and one that has too many, of which states are kept at intervals; from each of them gradients
/// are taken more than once.
#[test]
fn long_runs() {
    let system = OneCoordinate::from(Pendulum { gamma: -0.02 });
    let problem = Problem::new(&system, 0.0, VelocityPoint::new([1.0], [0.3], 0.0)).unwrap();
    for steps in [1000, 250_000] {
        let run = || problem.by(GaussCollocation { stages: 4 }).steps(Steps::Count(steps));
        let recorded = run().record(Until::Time(100.0)).unwrap();
        assert_eq!(recorded.outcome().status, Status::Completed);
        let covector = EndCovector { q: [1.0].into(), ..EndCovector::zero(1) };
        let gradient = recorded.pullback(&covector).unwrap();
        assert_eq!(gradient, recorded.pullback(&covector).unwrap());
        let tangent = run().tangent(&Variable::all(&problem), Until::Time(100.0)).unwrap();
        for (found, column) in all(&gradient).into_iter().zip(&tangent.columns) {
            let expected = column.q[0];
            assert!((found - expected).abs() <= 1e-11 * (1.0 + found.abs()), "{steps} steps: {found} and {expected}");
        }
    }
    assert_eq!(system.parameter_names(), ["gamma"]);
}
