//! Robust losses: outliers, the conditions of the minimum, and the covariance.

use crate::noise::Noise;
use herglotz_fit::{Curve, LeastSquares, Loss, Model};
use nalgebra::DMatrix;

fn points(count: usize) -> Vec<f64> {
    (0..count).map(|i| 4.0 * i as f64 / count as f64).collect()
}

fn decay(x: &[f64]) -> Curve<impl Fn(f64, &[f64], &mut [f64]) -> f64> {
    Curve::new(["amplitude", "rate"], x.to_vec(), |x, p, g| {
        let e = (-p[1] * x).exp();
        g.copy_from_slice(&[e, -p[0] * x * e]);
        p[0] * e
    })
}

#[test]
fn outliers_do_not_move_the_parameters() {
    let x = points(60);
    let model = decay(&x);
    let mut noise = Noise::new(1);
    let mut y: Vec<f64> = x.iter().map(|x| 2.0 * (-1.1 * x).exp() + 0.01 * noise.normal()).collect();
    for i in (3..60).step_by(7) {
        y[i] += 1.0 + 0.1 * (i % 5) as f64;
    }
    let problem = LeastSquares::new(&model, &y).unwrap();
    let error = |loss| {
        let fit = problem.clone().loss(loss).unwrap().solve(&[1.0, 1.0]).unwrap();
        assert!(fit.status.is_converged(), "{loss:?}: {fit}");
        // The gradient of the true cost vanishes.
        let slope = |r: f64| {
            let scale = loss.scale().unwrap_or(1.0);
            let a = (r / scale).abs();
            r * match loss {
                Loss::Linear => 1.0,
                Loss::Huber { .. } => 1.0_f64.min(1.0 / a),
                Loss::SoftL1 { .. } => (1.0 + a * a).sqrt().recip(),
                Loss::Cauchy { .. } => (1.0 + a * a).recip(),
            }
        };
        // Where the cost no longer decreases by 1e-14, residuals and columns are orthogonal to its root, 1e-7.
        let gradient = fit.jacobian.tr_mul(&fit.residuals.map(slope));
        assert!(gradient.norm() < 1e-7 * fit.jacobian.norm() * fit.residuals.norm(), "{loss:?}: {gradient}");
        assert!(fit.iterations < 60, "{loss:?}: {fit}");
        (fit.parameters[1] - 1.1).abs()
    };
    let scale = 0.03;
    let [linear, huber, soft, cauchy] =
        [Loss::Linear, Loss::Huber { scale }, Loss::SoftL1 { scale }, Loss::Cauchy { scale }].map(error);
    // To first order outliers with influences psi move the parameters by (J^T J)^-1 sum psi_i J_i, and the noise moves
    // them by its standard error, of which four are allowed; both are divided by the mean curvature of the loss. Of the
    // residuals without outliers, a third of the scale, it is at least 3/4, and these are 52 of 60.
    let mut values = vec![0.0; 60];
    let mut jacobian = DMatrix::zeros(60, 2);
    model.evaluate(&[2.0, 1.1], &mut values, Some(&mut jacobian)).unwrap();
    let cofactors = jacobian.tr_mul(&jacobian).try_inverse().unwrap();
    let of_outliers: f64 = (3..60).step_by(7).map(|i| (jacobian.row(i) * &cofactors)[1].abs()).sum();
    let noise = 4.0 * 0.01 * cofactors[(1, 1)].sqrt();
    let bound = |influence: f64| (influence * of_outliers + noise) / (0.75 * 52.0 / 60.0);
    // The influence of an outlier of size 1 is at most the scale for the first two losses, and C^2/r for Cauchy's.
    assert!(huber < bound(scale) && soft < bound(scale), "{huber} {soft} {}", bound(scale));
    assert!(cauchy < bound(scale * scale), "{cauchy} {}", bound(scale * scale));
    // Least squares are moved by ten times more than any of them.
    assert!(linear > 10.0 * cauchy && linear > 3.0 * huber, "{linear} {huber} {soft} {cauchy}");
}

#[test]
fn without_outliers_robust_losses_agree_with_least_squares() {
    let x = points(40);
    let model = decay(&x);
    let y: Vec<f64> = x.iter().enumerate().map(|(i, x)| 2.0 * (-x).exp() + 0.01 * (i as f64).sin()).collect();
    let problem = LeastSquares::new(&model, &y).unwrap();
    let least_squares = problem.solve(&[1.0, 2.0]).unwrap();
    let huber = problem.clone().loss(Loss::Huber { scale: 0.1 }).unwrap().solve(&[1.0, 2.0]).unwrap();
    // All residuals are below the scale: both minimise the same cost, to the convergence of a fit with small residuals.
    for i in 0..2 {
        assert!((huber.parameters[i] / least_squares.parameters[i] - 1.0).abs() < 1e-9);
        let (a, b) = (huber.standard_errors()[i].unwrap(), least_squares.standard_errors()[i].unwrap());
        assert!((a / b - 1.0).abs() < 1e-9);
    }
}

/// The errors are normal with outliers; the standard errors are compared with the scatter of the estimates.
#[test]
fn standard_errors_are_those_of_a_monte_carlo_estimate() {
    let x = points(80);
    let model = decay(&x);
    for loss in [Loss::Huber { scale: 0.03 }, Loss::Cauchy { scale: 0.05 }] {
        let mut noise = Noise::new(7);
        let (mut estimates, mut variances) = (Vec::new(), 0.0);
        const SAMPLES: usize = 600;
        for _ in 0..SAMPLES {
            let mut error = || {
                let size = if noise.uniform() < 0.1 { 0.3 } else { 0.02 };
                size * noise.normal()
            };
            let y: Vec<f64> = x.iter().map(|x| 2.0 * (-x).exp() + error()).collect();
            let fit = LeastSquares::new(&model, &y).unwrap().loss(loss).unwrap().solve(&[2.0, 1.0]).unwrap();
            estimates.push(fit.parameters[1]);
            variances += fit.standard_errors()[1].unwrap().powi(2) / SAMPLES as f64;
        }
        let mean = estimates.iter().sum::<f64>() / SAMPLES as f64;
        let scatter = estimates.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / (SAMPLES - 1) as f64;
        // The relative standard deviation of a standard deviation of 600 normal samples is 3 %: four of them.
        let ratio = (variances / scatter).sqrt();
        assert!((ratio - 1.0).abs() < 0.12, "{loss:?}: {ratio}");
    }
}
