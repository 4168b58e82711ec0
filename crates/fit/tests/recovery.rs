//! Fits whose results are known: exact data, the certified results of NIST, and counts of evaluations.

use herglotz_fit::{Curve, FitStatus, FunctionModel, LeastSquares, Model, ModelFailure, jacobian_defect};
use nalgebra::DMatrix;
use std::cell::Cell;

fn misra(x: f64, theta: &[f64], gradient: &mut [f64]) -> f64 {
    let e = (-theta[1] * x).exp();
    gradient.copy_from_slice(&[1.0 - e, theta[0] * x * e]);
    theta[0] * (1.0 - e)
}

const MISRA_X: [f64; 14] =
    [77.6, 114.9, 141.1, 190.8, 239.9, 289.0, 332.8, 378.4, 434.8, 477.3, 536.8, 593.1, 689.1, 760.0];
const MISRA_Y: [f64; 14] =
    [10.07, 14.73, 17.94, 23.93, 29.61, 35.18, 40.02, 44.82, 50.76, 55.05, 61.01, 66.40, 75.47, 81.78];

/// Misra1a of the Statistical Reference Datasets of NIST, from both of its starts.
#[test]
fn the_certified_results_of_nist() {
    let model = Curve::new(["b1", "b2"], MISRA_X, misra);
    for start in [[500.0, 0.0001], [250.0, 0.0005]] {
        let fit = LeastSquares::new(&model, &MISRA_Y).unwrap().solve(&start).unwrap();
        assert!(fit.status.is_converged(), "{}", fit.status);
        let errors = fit.standard_errors();
        let certified = [2.3894212918e2, 5.5015643181e-4];
        let certified_errors = [2.7070075241, 7.2668688436e-6];
        for i in 0..2 {
            // A relative decrease of the cost by its tolerance, 1e-14, is a change by 1e-7 standard errors. These, 1 % of
            // the parameters, change by the same fraction.
            let bound = 1e-7 * certified_errors[i];
            assert!((fit.parameters[i] - certified[i]).abs() < bound, "{fit}");
            let (error, relative) = (errors[i].unwrap() / certified_errors[i] - 1.0, bound / certified[i]);
            assert!(error.abs() < relative, "{fit}");
        }
        // The cost is stationary; the certified figures have 11 digits.
        for (found, certified) in
            [(2.0 * fit.cost, 1.2455138894e-1), (fit.residual_variance.unwrap().sqrt(), 1.0187876330e-1)]
        {
            assert!((found / certified - 1.0).abs() < 1e-10, "{found} is not {certified}");
        }
        assert_eq!(fit.degrees_of_freedom, 12);
        let table = fit.to_string();
        assert!(table.contains("b1 = 2.38942129") && table.contains("+- 2.707e0"), "{table}");
        assert!(table.contains("correlation of b1 and b2: -0.999"), "{table}");
    }
}

#[test]
fn exact_data_give_the_parameters_to_round_off() {
    let model = Curve::new(["b1", "b2"], MISRA_X, misra);
    let truth = [240.0, 5.5e-4];
    let mut y = [0.0; 14];
    model.evaluate(&truth, &mut y, None).unwrap();
    let fit = LeastSquares::new(&model, &y).unwrap().solve(&[500.0, 0.0001]).unwrap();
    assert!(fit.status.is_converged());
    // The condition of the scaled Jacobian is 50: ten times the round-off of the data times it.
    for (found, expected) in fit.parameters.iter().zip(truth) {
        assert!((found / expected - 1.0).abs() < 1e-13, "{fit}");
    }
    assert!(fit.iterations <= 16, "{fit}");
    assert_eq!(fit.parameter("b1"), Some(fit.parameters[0]));
    assert_eq!(fit.parameter("b3"), None);
}

/// A model that counts what is requested of it.
struct Counted<M> {
    model: M,
    is_joint: bool,
    values: Cell<usize>,
    jacobians: Cell<usize>,
}

impl<M: Model> Model for Counted<M> {
    fn parameter_names(&self) -> Vec<String> {
        self.model.parameter_names()
    }
    fn value_count(&self) -> usize {
        self.model.value_count()
    }
    fn evaluate(&self, theta: &[f64], values: &mut [f64], j: Option<&mut DMatrix<f64>>) -> Result<(), ModelFailure> {
        self.values.set(self.values.get() + 1);
        self.jacobians.set(self.jacobians.get() + usize::from(j.is_some()));
        self.model.evaluate(theta, values, j)
    }
    fn evaluates_jointly(&self) -> bool {
        self.is_joint
    }
}

#[test]
fn evaluations_are_counted_and_none_is_wasted() {
    for is_joint in [true, false] {
        let model = Curve::new(["b1", "b2"], MISRA_X, misra);
        let counted = Counted { model, is_joint, values: Cell::new(0), jacobians: Cell::new(0) };
        let fit = LeastSquares::new(&counted, &MISRA_Y).unwrap().solve(&[500.0, 0.0001]).unwrap();
        assert!(fit.status.is_converged());
        if is_joint {
            assert_eq!((counted.values.get(), counted.jacobians.get()), (fit.evaluations, fit.evaluations));
        } else {
            // The start has both. Every accepted point but the last, and that for the covariance, has a Jacobian.
            assert!(counted.jacobians.get() <= fit.iterations + 1, "{} {fit}", counted.jacobians.get());
            assert_eq!(counted.values.get(), fit.evaluations + counted.jacobians.get() - 1);
        }
    }
}

#[test]
fn a_limit_of_evaluations_ends_with_the_best_parameters() {
    let model = Curve::new(["b1", "b2"], MISRA_X, misra);
    let problem = LeastSquares::new(&model, &MISRA_Y).unwrap();
    let start_cost = problem.clone().max_evaluations(1).solve(&[500.0, 0.0001]).unwrap();
    assert_eq!(start_cost.evaluations, 1);
    let fit = problem.max_evaluations(4).solve(&[500.0, 0.0001]).unwrap();
    assert_eq!(fit.status, FitStatus::EvaluationLimit { limit: 4 });
    assert_eq!(fit.evaluations, 4);
    assert!(fit.cost < start_cost.cost);
    assert!(fit.to_string().contains("not converged after 4 evaluations"));
}

#[test]
fn zero_weights_and_standard_deviations() {
    let model = Curve::new(["b1", "b2"], MISRA_X, misra);
    let mut y = MISRA_Y;
    y[3] = f64::NAN;
    let mut weights = [1.0; 14];
    weights[3] = 0.0;
    let without = LeastSquares::new(&model, &y).unwrap().weights(&weights).unwrap().solve(&[250.0, 5e-4]).unwrap();
    let keep: Vec<usize> = (0..14).filter(|i| *i != 3).collect();
    let short = Curve::new(["b1", "b2"], keep.iter().map(|i| MISRA_X[*i]), misra);
    let data: Vec<f64> = keep.iter().map(|i| MISRA_Y[*i]).collect();
    let removed = LeastSquares::new(&short, &data).unwrap().solve(&[250.0, 5e-4]).unwrap();
    // The same sums up to zeros: round-off times the condition of 50.
    for (a, b) in without.parameters.iter().zip(&removed.parameters) {
        assert!((a / b - 1.0).abs() < 1e-12);
    }
    assert_eq!(without.degrees_of_freedom, removed.degrees_of_freedom);
    let ratio = without.residual_variance.unwrap() / removed.residual_variance.unwrap();
    assert!((ratio - 1.0).abs() < 1e-12);

    // Deviations that are twice as large: the covariance is the same, s^2 is a quarter, the cofactors are four times.
    let one = LeastSquares::new(&model, &MISRA_Y).unwrap().solve(&[250.0, 5e-4]).unwrap();
    let two = LeastSquares::new(&model, &MISRA_Y).unwrap().standard_deviations(&[2.0; 14]).unwrap();
    let two = two.solve(&[250.0, 5e-4]).unwrap();
    // Powers of two change no digit of the iteration.
    let ratio = |a: f64, b: f64| a / b;
    assert_eq!(one.parameters, two.parameters);
    assert!((ratio(one.covariance().unwrap()[(0, 1)], two.covariance().unwrap()[(0, 1)]) - 1.0).abs() < 1e-14);
    assert!((ratio(one.residual_variance.unwrap(), two.residual_variance.unwrap()) - 4.0).abs() < 1e-14);
    assert!((ratio(two.cofactors.unwrap()[(0, 0)], one.cofactors.unwrap()[(0, 0)]) - 4.0).abs() < 1e-14);
}

#[test]
fn jacobians_are_compared_with_differences() {
    let model = Curve::new(["b1", "b2"], MISRA_X, misra);
    let defects = jacobian_defect(&model, &[240.0, 5.5e-4]).unwrap();
    // Differences with relative steps h of 1e-3 have the truncation error h^4/30 and the round-off eps/h: 1e-12.
    assert!(defects.iter().all(|d| *d < 1e-11), "{defects:?}");
    let wrong = FunctionModel::new(
        ["a"],
        2,
        |p, out| out.copy_from_slice(&[p[0] * p[0], 3.0]),
        |p, out| out.copy_from_slice(&[p[0], 0.0]),
    );
    let defects = jacobian_defect(&wrong, &[1.5]).unwrap();
    assert!((defects[0] - 0.5).abs() < 1e-11, "{defects:?}");
}
