//! Multiple shooting: the same fit as with one piece, and fits that one piece does not find.

use crate::noise::Noise;
use crate::spring::Spring;
use contact_examples::systems::DoublePendulum;
use contact_geom::VelocityPoint;
use discrete_herglotz::sensitivity::Variable;
use herglotz_fit::{FitError, LeastSquares, Loss, Model, MotionModel, Observed};

fn parameter(name: &str) -> Variable {
    Variable::Parameter(name.to_owned())
}

fn times(count: u32, end: f64) -> Vec<f64> {
    (1..=count).map(|i| end * f64::from(i) / f64::from(count)).collect()
}

#[test]
fn the_same_fit_as_with_one_piece() {
    let grid = times(60, 20.0);
    let mut noise = Noise::new(5);
    let data: Vec<f64> = grid.iter().map(|t| Spring { k: 1.0, c: 0.1 }.position(*t) + 0.05 * noise.normal()).collect();
    let guess = Spring { k: 0.9, c: 0.09 };
    let unknowns = [parameter("k"), parameter("c"), Variable::Velocity(0)];
    let start = VelocityPoint::new([1.0], [0.1], 0.0);
    let model = MotionModel::new(&guess, 0.0, start, &unknowns, 0.4).unwrap();
    let model = model.observe(Observed::Position(0), &grid).unwrap();
    for loss in [Loss::Linear, Loss::Huber { scale: 0.05 }] {
        let problem = LeastSquares::new(&model, &data).unwrap().loss(loss).unwrap();
        let one = problem.solve(&model.start()).unwrap();
        // A node at a time of observation, and others between.
        let shooting = problem.multiple_shooting(&[3.0, grid[20], 11.1, 19.9]).unwrap();
        let many = shooting.solve(&model.start()).unwrap();
        assert!(one.status.is_converged() && many.fit.status.is_converged(), "{one}\n{many}");
        assert!(many.largest_defect < 1e-9, "{many}");
        assert!((many.fit.cost / one.cost - 1.0).abs() < 1e-9, "{one}\n{many}");
        assert_eq!((many.fit.rank, many.fit.degrees_of_freedom), (3, 57));
        for i in 0..3 {
            assert!((many.fit.parameters[i] - one.parameters[i]).abs() < 1e-7, "{one}\n{many}");
            let (a, b) = (many.fit.standard_errors()[i].unwrap(), one.standard_errors()[i].unwrap());
            assert!((a / b - 1.0).abs() < 1e-5, "{one}\n{many}");
        }
        let difference = (&many.fit.jacobian - &one.jacobian).norm() / one.jacobian.norm();
        assert!(difference < 1e-6, "{difference}");
        assert_eq!(many.nodes.len(), 4);
        assert!(many.to_string().contains("4 nodes, largest matching defect"));
    }
    // Without nodes it is the same.
    let problem = LeastSquares::new(&model, &data).unwrap();
    let none = problem.multiple_shooting(&[]).unwrap().solve(&model.start()).unwrap();
    assert_eq!(none.fit, problem.solve(&model.start()).unwrap());
}

/// Fifty periods, with wrong frequencies: one piece ends in local minima, pieces do not.
#[test]
fn a_long_motion_from_an_inaccurate_start() {
    let grid = times(600, 300.0);
    let truth = Spring { k: 1.0, c: 0.002 };
    let data: Vec<f64> = grid.iter().map(|t| truth.position(*t)).collect();
    let start = VelocityPoint::new([1.0], [0.0], 0.0);
    let nodes: Vec<f64> = (1..60).map(|i| 5.0 * f64::from(i)).collect();
    let mut local_minima = 0;
    for k in [0.3, 1.8, 2.5] {
        let guess = Spring { k, c: 0.002 };
        let model = MotionModel::new(&guess, 0.0, start, &[parameter("k")], 0.5).unwrap();
        let model = model.observe(Observed::Position(0), &grid).unwrap();
        let problem = LeastSquares::new(&model, &data).unwrap();
        // A fit may also end where no shorter step can be computed.
        let found = problem.solve(&model.start()).is_ok_and(|one| (one.parameters[0] - 1.0).abs() < 0.1);
        local_minima += usize::from(!found);
        let many = problem.multiple_shooting(&nodes).unwrap().solve(&model.start()).unwrap();
        assert!(many.fit.status.is_converged(), "{many}");
        // Defects that are 1e-12 of the data move the frequency by no more than they do in 300 units of time.
        assert!((many.fit.parameters[0] - 1.0).abs() < 1e-9, "{many}");
    }
    assert!(local_minima > 0, "one piece finds it too");
}

/// A chaotic double pendulum: both angles are observed, the start and a parameter are unknown.
#[test]
fn a_chaotic_motion() {
    let truth = DoublePendulum::default();
    let names = contact_geom::Parametric::parameter_names(&truth);
    let values = contact_geom::Parametric::parameters(&truth);
    let index = names.iter().position(|name| name.contains("gamma")).unwrap();
    let mut moved = values;
    moved[index] *= 1.5;
    let guess = contact_geom::Parametric::with_parameters(&truth, &moved).unwrap();
    let grid = times(150, 15.0);
    let start = VelocityPoint::new([2.0, 2.5], [0.0, 0.0], 0.0);
    let mut unknowns: Vec<Variable> = (0..2).map(Variable::Position).chain((0..2).map(Variable::Velocity)).collect();
    unknowns.push(parameter(&names[index]));
    let model = |lagrangian, start| {
        let model = MotionModel::new(lagrangian, 0.0, start, &unknowns, 0.05).unwrap();
        model.observe(Observed::Position(0), &grid).unwrap().observe(Observed::Position(1), &grid).unwrap()
    };
    let exact = model(&truth, start);
    let mut data = vec![0.0; 300];
    exact.evaluate(&exact.start(), &mut data, None).unwrap();
    let mut noise = Noise::new(9);
    for value in &mut data {
        *value += 0.005 * noise.normal();
    }
    let fitted = model(&guess, VelocityPoint::new([2.05, 2.45], [0.05, -0.05], 0.0));
    let problem = LeastSquares::new(&fitted, &data).unwrap();
    let nodes: Vec<f64> = (1..30).map(|i| 0.5 * f64::from(i)).collect();
    let many = problem.multiple_shooting(&nodes).unwrap().solve(&fitted.start()).unwrap();
    assert!(many.fit.status.is_converged() && many.largest_defect < 1e-8, "{many}");
    for (i, truth) in exact.start().iter().enumerate() {
        let ratio = (many.fit.parameters[i] - truth) / many.fit.standard_errors()[i].unwrap();
        assert!(ratio.abs() < 5.0, "{many}");
    }
    assert!((many.fit.residual_variance.unwrap().sqrt() / 0.005 - 1.0).abs() < 0.15, "{many}");
}

#[test]
fn invalid_nodes() {
    let spring = Spring { k: 1.0, c: 0.1 };
    let start = VelocityPoint::new([1.0], [0.0], 0.0);
    let model = MotionModel::new(&spring, 0.0, start, &[parameter("k")], 0.5).unwrap();
    let model = model.observe(Observed::Position(0), &times(10, 5.0)).unwrap();
    let problem = LeastSquares::new(&model, &[0.0; 10]).unwrap();
    for (nodes, index) in [(vec![0.0], 0), (vec![1.0, 1.0], 1), (vec![1.0, 5.0], 1), (vec![2.0, f64::NAN], 1)] {
        let error = problem.multiple_shooting(&nodes).map(|_| ()).unwrap_err();
        assert!(matches!(error, FitError::Node { index: i, .. } if i == index), "{error}");
        assert!(error.to_string().contains("must ascend strictly between the start and the last observation, 0 and 5"));
    }
    let shooting = problem.multiple_shooting(&[1.0, 2.0]).unwrap();
    let error = shooting.start_from(&[vec![1.0, 0.0, 0.0]]).map(|_| ()).unwrap_err();
    assert_eq!(error.to_string(), "states at nodes: there are 1, but there must be 2");
    let shooting = problem.multiple_shooting(&[1.0]).unwrap();
    let error = shooting.start_from(&[vec![1.0, 0.0]]).map(|_| ()).unwrap_err();
    assert_eq!(error.to_string(), "numbers of a state at a node: there are 2, but there must be 3");
}
