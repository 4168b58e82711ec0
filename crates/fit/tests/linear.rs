//! Linear models against the closed solution, for random problems; covariance against linear regression and a Monte
//! Carlo estimate.

use crate::noise::Noise;
use herglotz_fit::{Curve, FunctionModel, LeastSquares};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// theta = (A^T W^2 A)^-1 A^T W^2 y, with its covariance, from any start, for random scales of rows and columns.
    #[test]
    fn linear_models_have_the_closed_solution(
        n in 1usize..6,
        extra in 1usize..12,
        seed in any::<u64>(),
        exponents in prop::collection::vec(-6i32..7, 6),
    ) {
        let m = n + extra;
        let mut noise = Noise::new(seed);
        let a = DMatrix::from_fn(m, n, |_, j| noise.normal() * 10f64.powi(exponents[j]));
        let y = DVector::from_fn(m, |_, _| noise.normal());
        let weights = DVector::from_fn(m, |_, _| 0.2 + noise.uniform());
        let start: Vec<f64> = (0..n).map(|j| 10.0 * noise.normal() * 10f64.powi(-exponents[j])).collect();
        let model = FunctionModel::new(
            (0..n).map(|j| format!("p{j}")),
            m,
            |p, out| out.copy_from_slice((&a * DVector::from_column_slice(p)).as_slice()),
            |_, out| out.copy_from(&a),
        );
        let problem = LeastSquares::new(&model, y.as_slice()).unwrap().weights(weights.as_slice()).unwrap();
        let fit = problem.solve(&start).unwrap();
        prop_assert!(fit.status.is_converged(), "{fit}");

        let weighted = DMatrix::from_fn(m, n, |i, j| weights[i] * a[(i, j)]);
        let target = weights.component_mul(&y);
        let scale = DVector::from_fn(n, |j, _| weighted.column(j).norm());
        let scaled = DMatrix::from_fn(m, n, |i, j| weighted[(i, j)] / scale[j]);
        let condition = {
            let s = scaled.clone().svd(false, false).singular_values;
            s[0] / s[n - 1]
        };
        prop_assume!(condition < 1e4);
        let normal = scaled.tr_mul(&scaled).try_inverse().unwrap();
        let solution = &normal * scaled.tr_mul(&target);
        // The closed solution by normal equations loses the square of the condition.
        let bound = 1e-12 * condition * condition;
        for j in 0..n {
            let difference = fit.parameters[j] * scale[j] - solution[j];
            prop_assert!(difference.abs() <= bound * (1.0 + solution.norm()), "{fit}\n{solution}");
        }
        let variance = (&scaled * &solution - &target).norm_squared() / extra as f64;
        let covariance = fit.covariance().unwrap();
        for i in 0..n {
            for j in 0..n {
                let expected = variance * normal[(i, j)];
                let size = variance * (normal[(i, i)] * normal[(j, j)]).sqrt();
                let found = covariance[(i, j)] * scale[i] * scale[j];
                prop_assert!((found - expected).abs() <= 100.0 * bound * size, "{found} {expected}");
            }
        }
        let correlation = fit.correlation().unwrap();
        prop_assert!(correlation.iter().all(|c| c.abs() <= 1.0 + 1e-12));
    }
}

/// Simple linear regression by the textbook.
#[test]
fn the_standard_errors_of_a_line() {
    let x = [1.0, 2.0, 3.0, 5.0, 8.0];
    let y = [2.1, 3.9, 6.2, 9.8, 16.1];
    let model = Curve::new(["intercept", "slope"], x, |x, p, g| {
        g.copy_from_slice(&[1.0, x]);
        p[0] + p[1] * x
    });
    let fit = LeastSquares::new(&model, &y).unwrap().solve(&[0.0, 0.0]).unwrap();
    let (mean_x, mean_y) = (x.iter().sum::<f64>() / 5.0, y.iter().sum::<f64>() / 5.0);
    let sxx: f64 = x.iter().map(|x| (x - mean_x).powi(2)).sum();
    let slope = x.iter().zip(&y).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum::<f64>() / sxx;
    let intercept = mean_y - slope * mean_x;
    let s2 = x.iter().zip(&y).map(|(x, y)| (y - intercept - slope * x).powi(2)).sum::<f64>() / 3.0;
    assert!((fit.parameters[0] - intercept).abs() < 1e-13 && (fit.parameters[1] - slope).abs() < 1e-13);
    assert!((fit.standard_error("slope").unwrap() - (s2 / sxx).sqrt()).abs() < 1e-14);
    let error = (s2 * (0.2 + mean_x * mean_x / sxx)).sqrt();
    assert!((fit.standard_error("intercept").unwrap() - error).abs() < 1e-14);
    let correlation = -mean_x / (mean_x * mean_x + sxx / 5.0).sqrt();
    assert!((fit.correlation().unwrap()[(0, 1)] - correlation).abs() < 1e-13);
}

#[test]
fn the_covariance_is_that_of_a_monte_carlo_estimate() {
    let x: Vec<f64> = (0..50).map(|i| 0.1 * f64::from(i)).collect();
    let model = Curve::new(["amplitude", "rate"], x.clone(), |x, p, g| {
        let e = (-p[1] * x).exp();
        g.copy_from_slice(&[e, -p[0] * x * e]);
        p[0] * e
    });
    const SAMPLES: usize = 1500;
    let mut noise = Noise::new(3);
    let (mut estimates, mut covariance) = (Vec::new(), DMatrix::<f64>::zeros(2, 2));
    for _ in 0..SAMPLES {
        let y: Vec<f64> = x.iter().map(|x| 2.0 * (-0.8 * x).exp() + 0.05 * noise.normal()).collect();
        let fit = LeastSquares::new(&model, &y).unwrap().solve(&[1.5, 1.0]).unwrap();
        estimates.push(DVector::from_column_slice(&fit.parameters));
        covariance += fit.covariance().unwrap() / SAMPLES as f64;
    }
    let mean = estimates.iter().sum::<DVector<f64>>() / SAMPLES as f64;
    let scatter = estimates.iter().map(|e| (e - &mean) * (e - &mean).transpose()).sum::<DMatrix<f64>>();
    let scatter = scatter / (SAMPLES - 1) as f64;
    // The relative standard deviation of a variance of 1500 samples is 4 %.
    for (found, expected) in covariance.iter().zip(scatter.iter()) {
        assert!((found / expected - 1.0).abs() < 0.15, "{covariance} {scatter}");
    }
}
