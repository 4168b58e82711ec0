//! Fits of motions: the damped spring of diffsol's book, Jacobians, starts, observables, invalid input.

use crate::noise::Noise;
use crate::spring::Spring;
use contact_examples::systems::{DoublePendulum, Pendulum};
use contact_geom::{Scalar, VelocityPoint};
use discrete_herglotz::sensitivity::{EndState, Loss, Variable};
use discrete_herglotz::{GaussCollocation, Problem, Row, Rows, Steps, Until};
use herglotz_fit::{FitError, FitStatus, LeastSquares, Model, MotionModel, Observed, jacobian_defect};

fn parameter(name: &str) -> Variable {
    Variable::Parameter(name.to_owned())
}

fn at_rest(q: f64) -> VelocityPoint<1> {
    VelocityPoint::new([q], [0.0], 0.0)
}

fn times(count: u32, end: f64) -> Vec<f64> {
    (0..count).map(|i| end * f64::from(i) / f64::from(count - 1)).collect()
}

#[test]
fn the_damped_spring_of_the_book_of_diffsol() {
    let times = times(101, 40.0);
    let data: Vec<f64> = times.iter().map(|t| Spring { k: 1.0, c: 0.1 }.position(*t)).collect();
    let guess = Spring { k: 0.9, c: 0.09 };
    let model = MotionModel::new(&guess, 0.0, at_rest(1.0), &[parameter("k"), parameter("c")], 0.4).unwrap();
    let model = model.observe(Observed::Position(0), &times).unwrap();
    assert_eq!(model.start(), [0.9, 0.09]);
    let fit = LeastSquares::new(&model, &data).unwrap().solve(&model.start()).unwrap();
    assert!(fit.status.is_converged(), "{fit}");
    assert!((fit.parameters[0] - 1.0).abs() < 1e-12 && (fit.parameters[1] - 0.1).abs() < 1e-12, "{fit}");
    assert!(fit.iterations <= 10, "{fit}");
    assert_eq!(model.lagrangian_at(&fit.parameters).unwrap().k, fit.parameters[0]);
}

/// Exact data of the computed motion are reproduced to round-off: parameters, start and action.
#[test]
fn parameters_and_start_together() {
    let (truth, guess) = (Spring { k: 1.3, c: 0.2 }, Spring { k: 1.1, c: 0.1 });
    let (q_times, z_times) = (times(40, 12.0), times(7, 10.0));
    let unknowns = [parameter("c"), Variable::Position(0), Variable::Velocity(0), parameter("k"), Variable::Action];
    let model = |guess, start| {
        MotionModel::new(guess, 0.0, start, &unknowns, 0.5)
            .unwrap()
            .observe(Observed::Position(0), &q_times)
            .unwrap()
            .observe(Observed::Action, &z_times)
            .unwrap()
    };
    let truth_model = model(&truth, VelocityPoint::new([0.7], [-0.4], 0.2));
    let mut data = vec![0.0; 47];
    let theta = truth_model.start();
    truth_model.evaluate(&theta, &mut data, None).unwrap();
    let fitted = model(&guess, VelocityPoint::new([0.5], [0.0], 0.0));
    assert_eq!(fitted.parameter_names(), ["c", "q[0]", "v[0]", "k", "z"]);
    let fit = LeastSquares::new(&fitted, &data).unwrap().solve(&fitted.start()).unwrap();
    assert!(fit.status.is_converged(), "{fit}");
    for (found, expected) in fit.parameters.iter().zip(&theta) {
        assert!((found - expected).abs() < 1e-12, "{fit}");
    }
    let state = fitted.state_at(&fit.parameters);
    assert_eq!((state.q[0], state.v[0], state.z), (fit.parameters[1], fit.parameters[2], fit.parameters[4]));
}

/// `2 q v + z^2`, and the momentum.
struct Mixed;
impl Loss<1> for Mixed {
    fn value<T: Scalar>(&self, state: &EndState<1, T>) -> T {
        state.q[0] * state.v[0] * 2.0 + state.z * state.z + state.p[0]
    }
}

#[test]
fn jacobians_from_tangents_agree_with_differences() {
    let pendulum = Pendulum { gamma: -0.1 };
    let unknowns = [parameter("gamma"), Variable::Velocity(0), Variable::Action, Variable::Position(0)];
    let grid = times(9, 7.0);
    let model = MotionModel::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.3], 0.1), &unknowns, 0.6)
        .unwrap()
        .observe(Observed::Position(0), &grid)
        .unwrap()
        .observe(Observed::Velocity(0), &[0.0, 3.3])
        .unwrap()
        .observe(Observed::Momentum(0), &[0.0, 0.1, 3.3, 7.0])
        .unwrap()
        .observe(Observed::Action, &[0.0, 6.9])
        .unwrap()
        .observe(Observed::function(Mixed), &grid)
        .unwrap();
    assert_eq!(model.value_count(), 26);
    let defects = jacobian_defect(&model, &model.start()).unwrap();
    assert!(defects.iter().all(|d| *d < 1e-8), "{defects:?}");

    let double = DoublePendulum::default();
    let mut unknowns: Vec<Variable> = (0..2).map(Variable::Position).chain((0..2).map(Variable::Velocity)).collect();
    unknowns.extend(contact_geom::Parametric::parameter_names(&double).into_iter().map(Variable::Parameter));
    let start = VelocityPoint::new([0.8, -0.4], [0.1, 0.2], 0.0);
    let model = MotionModel::new(&double, 0.0, start, &unknowns, 0.1).unwrap();
    let model = model.observe(Observed::Position(1), &times(12, 2.0)).unwrap();
    let model = model.observe(Observed::Momentum(0), &times(12, 2.0)).unwrap();
    let defects = jacobian_defect(&model, &model.start()).unwrap();
    assert!(defects.iter().all(|d| *d < 1e-7), "{defects:?}");
}

/// Values are those of rows of a run, in the order in which they were added, with times that repeat.
#[test]
fn values_are_those_of_a_run() {
    let pendulum = Pendulum { gamma: -0.1 };
    let start = VelocityPoint::new([1.0], [0.3], 0.1);
    let model = MotionModel::new(&pendulum, 0.0, start, &[parameter("gamma")], 0.5).unwrap().with_stages(6);
    let model = model.observe(Observed::Velocity(0), &[2.2, 0.7, 0.7]).unwrap();
    let model = model.observe(Observed::Position(0), &[4.0, 0.7]).unwrap();
    let mut values = vec![0.0; 5];
    model.evaluate(&[-0.1], &mut values, None).unwrap();
    let problem = Problem::new(&pendulum, 0.0, start).unwrap();
    let mut rows = Rows::at([0.7, 2.2, 4.0]).unwrap().with_velocity();
    problem
        .by(GaussCollocation { stages: 6 })
        .steps(Steps::Size(0.5))
        .observe(&mut rows)
        .run(Until::Time(4.0))
        .unwrap();
    let [a, b, c] = rows.rows.as_slice() else { panic!() };
    let v = |row: &Row| row.v.as_ref().unwrap()[0];
    let expected = [v(b), v(a), v(a), c.q[0], a.q[0]];
    for (found, expected) in values.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-14, "{values:?} {expected:?}");
    }
}

/// Noise in the data: the estimates scatter as their standard errors say, and none is far off.
#[test]
fn noisy_data() {
    let times = times(101, 40.0);
    let guess = Spring { k: 0.9, c: 0.09 };
    let model = MotionModel::new(&guess, 0.0, at_rest(1.0), &[parameter("k"), parameter("c")], 0.4).unwrap();
    let model = model.observe(Observed::Position(0), &times).unwrap();
    let mut noise = Noise::new(11);
    let mut squares = [0.0; 2];
    const SAMPLES: usize = 100;
    for _ in 0..SAMPLES {
        let exact = times.iter().map(|t| Spring { k: 1.0, c: 0.1 }.position(*t));
        let data: Vec<f64> = exact.map(|x| x + 0.02 * noise.normal()).collect();
        let fit = LeastSquares::new(&model, &data).unwrap().solve(&model.start()).unwrap();
        assert!(fit.status.is_converged(), "{fit}");
        for (i, truth) in [1.0, 0.1].into_iter().enumerate() {
            let ratio = (fit.parameters[i] - truth) / fit.standard_errors()[i].unwrap();
            assert!(ratio.abs() < 4.5, "{fit}");
            squares[i] += ratio * ratio / SAMPLES as f64;
        }
    }
    // The relative standard deviation of a variance of 100 samples is 14 %.
    assert!(squares.iter().all(|s| (0.6..1.5).contains(s)), "{squares:?}");
}

/// Stiffness and mass enter as a ratio where only positions are observed.
#[test]
fn an_undetermined_parameter_of_a_motion_is_named() {
    let spring = crate::spring::Heavy { m: 1.0, k: 1.1 };
    let model = MotionModel::new(&spring, 0.0, at_rest(1.0), &[parameter("m"), parameter("k")], 0.4).unwrap();
    let model = model.observe(Observed::Position(0), &times(30, 9.0)).unwrap();
    let data: Vec<f64> = times(30, 9.0).iter().map(|t| t.cos()).collect();
    let fit = LeastSquares::new(&model, &data).unwrap().solve(&model.start()).unwrap();
    let FitStatus::Undetermined(null_space) = &fit.status else { panic!("{fit}") };
    assert!(null_space.to_string().contains("rank 1 of 2; the model does not change with `m` : `k` = 1.0000 : 1.0000"));
    assert!((fit.parameters[1] / fit.parameters[0] - 1.0).abs() < 1e-9, "{fit}");
}

#[test]
fn steps_for_an_accuracy() {
    let guess = Spring { k: 0.9, c: 0.09 };
    let model = MotionModel::new(&guess, 0.0, at_rest(1.0), &[parameter("k")], 10.0).unwrap();
    let model = model.observe(Observed::Position(0), &times(11, 40.0)).unwrap().accuracy(1e-9).unwrap();
    assert!((0.3..4.0).contains(&model.step_size()), "{}", model.step_size());
    let mut values = vec![0.0; 11];
    model.evaluate(&[0.9], &mut values, None).unwrap();
    for (value, t) in values.iter().zip(times(11, 40.0)) {
        assert!((value - guess.position(t)).abs() < 1e-9);
    }
}

#[test]
fn invalid_input() {
    let spring = Spring { k: 1.0, c: 0.1 };
    let new = |unknowns: &[Variable], h| MotionModel::new(&spring, 1.0, at_rest(1.0), unknowns, h).map(|_| ());
    let observe = |observed, times: &[f64]| {
        let model = MotionModel::new(&spring, 1.0, at_rest(1.0), &[parameter("k")], 0.1).unwrap();
        model.observe(observed, times).map(|_| ()).unwrap_err()
    };
    let expected = [
        (new(&[parameter("kk")], 0.1).unwrap_err(), "there is no parameter `kk`; did you mean `k`?"),
        (
            new(&[Variable::Position(1)], 0.1).unwrap_err(),
            "there is no coordinate 1; the coordinates are counted from 0 to 0",
        ),
        (
            new(&[Variable::EndTime], 0.1).unwrap_err(),
            "EndTime cannot be an unknown of a fit; choose among parameters, and positions, velocities and the action of \
             the start",
        ),
        (new(&[], 0.0).unwrap_err(), "the step size is 0; it must be positive and finite"),
        (observe(Observed::Velocity(3), &[2.0]), "there is no coordinate 3; the coordinates are counted from 0 to 0"),
        (
            observe(Observed::Action, &[2.0, 0.5]),
            "the time 1 is 0.5; times must be finite and not before the start t0 = 1",
        ),
        (
            observe(Observed::Action, &[f64::NAN]),
            "the time 0 is NaN; times must be finite and not before the start t0 = 1",
        ),
    ];
    for (error, text) in expected {
        assert_eq!(error.to_string(), text);
    }
    // A motion that cannot be computed names the parameters.
    let model = MotionModel::new(&spring, 0.0, at_rest(1.0), &[parameter("k")], 0.1).unwrap();
    let model = model.observe(Observed::Position(0), &[1.0, 2.0]).unwrap();
    let error = LeastSquares::new(&model, &[0.5, 0.1]).unwrap().solve(&[1e300]).unwrap_err();
    let FitError::Model { parameters, .. } = &error else { panic!("{error}") };
    assert_eq!(parameters, &[1e300]);
    // Steps that do not resolve the motion are refused, not fitted.
    let model = MotionModel::new(&spring, 0.0, at_rest(1.0), &[parameter("k")], 40.0).unwrap().with_stages(1);
    let model = model.observe(Observed::Position(0), &[400.0]).unwrap();
    let error = LeastSquares::new(&model, &[0.5]).unwrap().solve(&[1.0]).unwrap_err();
    assert!(error.to_string().contains("take a smaller step"), "{error}");
}
