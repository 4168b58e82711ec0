//! Several starts of one fit.

use herglotz_fit::{Curve, FitError, FitStatus, LeastSquares};

fn points() -> Vec<f64> {
    (0..100).map(|i| 0.2 * f64::from(i)).collect()
}

fn wave() -> Curve<impl Fn(f64, &[f64], &mut [f64]) -> f64> {
    Curve::new(["frequency", "phase"], points(), |x, p, g| {
        if p[0] < 0.0 {
            return f64::NAN;
        }
        let (s, c) = (p[0] * x + p[1]).sin_cos();
        g.copy_from_slice(&[x * c, c]);
        s
    })
}

#[test]
fn the_best_start_is_found_and_each_result_kept() {
    let (x, model) = (points(), wave());
    let y: Vec<f64> = x.iter().map(|x| (2.0 * x + 0.3).sin()).collect();
    let problem = LeastSquares::new(&model, &y).unwrap();
    // The cost has a minimum near every few multiples of 2 pi/20.
    let mut starts: Vec<[f64; 2]> = (0..15).map(|i| [0.3 + 0.25 * f64::from(i), 0.0]).collect();
    starts.push([-1.0, 0.0]);
    let fits = problem.solve_from(&starts);
    assert_eq!(fits.fits.len(), 16);
    let best = fits.best().unwrap();
    assert!((best.parameters[0] - 2.0).abs() < 1e-12, "{best}");
    let local = fits.fits.iter().flatten().filter(|fit| fit.cost > 1.0).count();
    assert!(local >= 5, "only {local} local minima");
    assert!(matches!(&fits.fits[15], Err(FitError::Model { .. })));
    for threads in [0, 1, 3, 40] {
        let parallel = problem.solve_in_threads(&starts, threads);
        assert_eq!(parallel.best_index(), fits.best_index());
        for (one, other) in parallel.fits.iter().zip(&fits.fits) {
            // The error has a NaN.
            let is_equal = match (one, other) {
                (Ok(one), Ok(other)) => one == other,
                (Err(one), Err(other)) => one.to_string() == other.to_string(),
                _ => false,
            };
            assert!(is_equal);
        }
        assert_eq!(parallel.fits.len(), 16);
    }
}

#[test]
fn starts_without_a_fit() {
    let model = wave();
    let problem = LeastSquares::new(&model, &[0.5; 100]).unwrap();
    let fits = problem.solve_from(&[[-1.0, 0.0], [-2.0, 0.0]]);
    assert_eq!(fits.best_index(), None);
    let Err(FitError::Model { parameters, .. }) = fits.best() else { panic!() };
    assert_eq!(parameters, [-1.0, 0.0]);
}

#[test]
fn a_minimum_is_better_than_a_lower_cost_at_the_limit() {
    let (x, model) = (points(), wave());
    let y: Vec<f64> = x.iter().map(|x| (2.0 * x + 0.3).sin()).collect();
    let problem = LeastSquares::new(&model, &y).unwrap();
    let minimum = problem.solve(&[0.3, 0.0]).unwrap();
    let cut = problem.max_evaluations(1).solve(&[2.0, 0.29]).unwrap();
    assert!(cut.cost < minimum.cost && matches!(cut.status, FitStatus::EvaluationLimit { .. }));
    let fits = herglotz_fit::MultiStart { fits: vec![Ok(cut), Ok(minimum)] };
    assert_eq!(fits.best_index(), Some(1));
}
