//! Models that cannot be evaluated, and invalid input.

use herglotz_fit::{Curve, FitError, LeastSquares, Loss, Model, ModelFailure, jacobian_defect};
use nalgebra::DMatrix;

fn line() -> Curve<impl Fn(f64, &[f64], &mut [f64]) -> f64> {
    Curve::new(["a", "b"], [0.0, 1.0, 2.0], |x, p, g| {
        g.copy_from_slice(&[1.0, x]);
        p[0] + x * p[1]
    })
}

#[test]
fn a_model_that_is_not_a_number_names_the_parameters() {
    let model = Curve::new(["a", "b"], [1.0, 2.0, 3.0], |x, p, g| {
        let root = (p[0] + p[1] * x).sqrt();
        g.copy_from_slice(&[0.5 / root, 0.5 * x / root]);
        root
    });
    let error = LeastSquares::new(&model, &[1.0, 2.0, 3.0]).unwrap().solve(&[1.0, -0.5]).unwrap_err();
    let FitError::Model { parameters, failure: ModelFailure::Value { index: 2, .. }, .. } = &error else {
        panic!("{error}")
    };
    assert_eq!(parameters, &[1.0, -0.5]);
    let text = error.to_string();
    assert!(text.contains("cannot be evaluated at a = 1, b = -0.5: its value 2 is NaN"), "{text}");
    // A derivative that is infinite.
    let error = LeastSquares::new(&model, &[1.0, 2.0, 3.0]).unwrap().solve(&[0.0, 0.0]).unwrap_err();
    assert!(error.to_string().contains("the derivative of its value 0 with respect to `a` is inf"), "{error}");
}

#[test]
fn a_step_to_where_the_model_is_not_defined_is_shortened() {
    // The first step of the iteration from 0.05 overshoots to negative rates.
    let x: Vec<f64> = (0..10).map(f64::from).collect();
    let model = Curve::new(["rate"], x.clone(), |x, p, g| {
        let root = p[0].powf(1.5);
        g[0] = x * 1.5 * p[0].sqrt();
        x * root
    });
    let y: Vec<f64> = x.iter().map(|x| x * 0.008).collect();
    let fit = LeastSquares::new(&model, &y).unwrap().solve(&[4.0]).unwrap();
    assert!(fit.status.is_converged() && (fit.parameters[0] - 0.04).abs() < 1e-12, "{fit}");
    // Where the minimum is beyond, and the model undefined there, the fit says so.
    let model = Curve::new(["p"], x.clone(), |x, p, g| {
        g[0] = x;
        if p[0] < 1.0 { f64::NAN } else { x * p[0] }
    });
    let error =
        LeastSquares::new(&model, &x.iter().map(|x| x * 0.5).collect::<Vec<_>>()).unwrap().solve(&[3.0]).unwrap_err();
    let FitError::Model { parameters, .. } = &error else { panic!("{error}") };
    assert!(parameters[0] < 1.0 && parameters[0] > 0.9, "{error}");
    // With a bound there it is a minimum.
    let y: Vec<f64> = x.iter().map(|x| x * 0.5).collect();
    let fit = LeastSquares::new(&model, &y).unwrap().bounds("p", 1.0, 9.0).unwrap().solve(&[3.0]).unwrap();
    assert_eq!(fit.parameters, [1.0]);
}

/// A model that fails in words.
struct Refusing;
impl Model for Refusing {
    fn parameter_names(&self) -> Vec<String> {
        vec!["a".into()]
    }
    fn value_count(&self) -> usize {
        2
    }
    fn evaluate(&self, _: &[f64], _: &mut [f64], _: Option<&mut DMatrix<f64>>) -> Result<(), ModelFailure> {
        Err(ModelFailure::Undefined("the run ended at t = 3".into()))
    }
}

#[test]
fn the_reason_of_a_model_is_passed_on() {
    let error = LeastSquares::new(&Refusing, &[1.0, 2.0]).unwrap().solve(&[1.0]).unwrap_err();
    assert!(error.to_string().contains("at a = 1: the run ended at t = 3; start elsewhere"), "{error}");
    assert!(matches!(jacobian_defect(&Refusing, &[1.0]), Err(FitError::Model { .. })));
    // A slice that the model does not write is found.
    let forgetful = herglotz_fit::FunctionModel::new(["a"], 2, |_, _| (), |_, _| ());
    let error = LeastSquares::new(&forgetful, &[1.0, 2.0]).unwrap().solve(&[1.0]).unwrap_err();
    assert!(matches!(error, FitError::Model { failure: ModelFailure::Value { index: 0, .. }, .. }), "{error}");
}

#[test]
fn invalid_input() {
    let model = line();
    let problem = || LeastSquares::new(&model, &[1.0, 2.0, 3.0]).unwrap();
    let texts = [
        LeastSquares::new(&model, &[1.0]).unwrap_err(),
        LeastSquares::new(&Curve::new(Vec::<String>::new(), [1.0], |_, _, _| 0.0), &[1.0]).unwrap_err(),
        LeastSquares::new(&Curve::new(["a", "b", "a"], [1.0], |_, _, _| 0.0), &[1.0]).unwrap_err(),
        problem().weights(&[1.0]).unwrap_err(),
        problem().weights(&[1.0, -1.0, 1.0]).unwrap_err(),
        problem().weights(&[1.0, 1.0, f64::NAN]).unwrap_err(),
        problem().standard_deviations(&[1.0, 0.0, 1.0]).unwrap_err(),
        problem().standard_deviations(&[f64::NAN, 0.0, 1.0]).unwrap_err(),
        problem().bounds("c", 0.0, 1.0).unwrap_err(),
        problem().bounds("a", 2.0, 1.0).unwrap_err(),
        problem().bounds("a", f64::NAN, 1.0).unwrap_err(),
        problem().loss(Loss::Huber { scale: 0.0 }).unwrap_err(),
        problem().tolerances(1e-9, -1.0, 1e-9).unwrap_err(),
        problem().step_bound(f64::INFINITY).unwrap_err(),
        problem().rank_tolerance(f64::NAN).unwrap_err(),
        problem().solve(&[1.0]).unwrap_err(),
        problem().solve(&[1.0, f64::NAN]).unwrap_err(),
        problem().bounds("a", 0.0, 1.0).unwrap().solve(&[2.0, 0.0]).unwrap_err(),
        LeastSquares::new(&model, &[1.0, f64::INFINITY, 3.0]).unwrap().solve(&[1.0, 1.0]).unwrap_err(),
        problem().solve_from::<[f64; 2]>(&[]).best().unwrap_err(),
        jacobian_defect(&model, &[1.0]).unwrap_err(),
    ];
    let expected = [
        "measured values: there are 1, but there must be 3",
        "the model has no parameters; there is nothing to fit",
        "two parameters have the name `a`; give each its own name",
        "weights: there are 1, but there must be 3",
        "the weight of the measured value 1 is -1; weights must be finite and at least 0",
        "the weight of the measured value 2 is NaN; weights must be finite and at least 0",
        "the standard deviation of the measured value 1 is 0; standard deviations must be positive (infinite for a value \
         that is to be ignored)",
        "the standard deviation of the measured value 0 is NaN; standard deviations must be positive (infinite for a \
         value that is to be ignored)",
        "there is no parameter `c`; the parameters are a, b",
        "the bounds of `a` are 2 and 1; the lower bound must not exceed the upper one (infinite where there is none)",
        "the bounds of `a` are NaN and 1; the lower bound must not exceed the upper one (infinite where there is none)",
        "the scale of the loss is 0; it must be positive and finite",
        "the tolerance of the parameters is -1; it must be positive and finite",
        "the bound of the first step is inf; it must be positive and finite",
        "the tolerance of the rank is NaN; it must be positive and finite",
        "parameters of the start: there are 1, but there must be 2",
        "the start of `b` is NaN; it must be finite and between -inf and inf",
        "the start of `a` is 2; it must be finite and between 0 and 1",
        "the measured value 1 is inf; values must be finite, or have the weight 0",
        "there is no start; give at least one",
        "parameters: there are 1, but there must be 2",
    ];
    for (found, expected) in texts.iter().zip(expected) {
        assert_eq!(found.to_string(), expected);
    }
}

#[test]
fn an_infinite_standard_deviation_ignores_the_value() {
    let model = line();
    let problem = LeastSquares::new(&model, &[1.0, f64::NAN, 3.0]).unwrap();
    let fit = problem.standard_deviations(&[1.0, f64::INFINITY, 1.0]).unwrap().solve(&[0.0, 0.0]).unwrap();
    assert!((fit.parameters[0] - 1.0).abs() < 1e-14 && (fit.parameters[1] - 1.0).abs() < 1e-14, "{fit}");
    assert_eq!(fit.residuals[1], 0.0);
}
