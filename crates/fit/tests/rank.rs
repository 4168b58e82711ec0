//! Parameters that the data do not determine are named.

use herglotz_fit::{Curve, FitError, FitStatus, LeastSquares, NullSpace};

fn x() -> Vec<f64> {
    (1..=12).map(|i| f64::from(i) * 0.3).collect()
}

#[test]
fn two_parameters_that_enter_only_as_a_product() {
    let model = Curve::new(["stiffness", "damping", "mass"], x(), |x, p, g| {
        let [k, c, m] = [p[0], p[1], p[2]];
        let s = (k / m * x).sin();
        let cos = (k / m * x).cos();
        g.copy_from_slice(&[c * x / m * cos, s, -c * k * x / (m * m) * cos]);
        c * s
    });
    let y: Vec<f64> = x().iter().map(|x| 2.0 * (0.5 * x).sin()).collect();
    let fit = LeastSquares::new(&model, &y).unwrap().solve(&[1.0, 1.0, 1.5]).unwrap();
    let FitStatus::Undetermined(null) = &fit.status else { panic!("{fit}") };
    assert_eq!((null.rank, null.parameters, fit.rank), (2, 3, 2));
    // k/m remains 1/2: dk/k = dm/m.
    assert!((fit.parameters[0] / fit.parameters[2] - 0.5).abs() < 1e-12, "{fit}");
    let [direction] = null.directions.as_slice() else { panic!("{null}") };
    let [(first, one), (second, ratio)] = direction.changes.as_slice() else { panic!("{null}") };
    assert_eq!((first.as_str(), *one, second.as_str()), ("stiffness", 1.0, "mass"));
    assert!((ratio - 2.0).abs() < 1e-9, "{null}");
    assert_eq!((fit.cofactors.clone(), fit.covariance(), fit.standard_errors()), (None, None, vec![None; 3]));
    let text = fit.to_string();
    assert!(
        text.contains("rank 2 of 3; the model does not change with `stiffness` : `mass` = 1.0000 : 2.0000"),
        "{text}"
    );
    // With the mass held fixed, all others are determined.
    let fit = LeastSquares::new(&model, &y).unwrap().bounds("mass", 1.5, 1.5).unwrap().solve(&[1.0, 1.0, 1.5]).unwrap();
    assert!(fit.status.is_converged() && (fit.parameters[0] - 0.75).abs() < 1e-12, "{fit}");
}

#[test]
fn a_parameter_without_effect_is_named_alone() {
    let model = Curve::new(["a", "idle", "b", "c"], x(), |x, p, g| {
        g.copy_from_slice(&[1.0, 0.0, x, x]);
        p[0] + (p[2] + p[3]) * x
    });
    let y: Vec<f64> = x().iter().map(|x| 1.0 + x).collect();
    let fit = LeastSquares::new(&model, &y).unwrap().solve(&[0.0; 4]).unwrap();
    let FitStatus::Undetermined(null) = &fit.status else { panic!("{fit}") };
    let mut texts: Vec<String> = null.directions.iter().map(ToString::to_string).collect();
    texts.sort();
    assert_eq!((null.rank, texts), (2, vec!["`b` : `c` = 1.0000 : -1.0000".to_owned(), "`idle`".to_owned()]));
}

#[test]
fn fewer_data_than_parameters_are_refused_with_the_null_direction() {
    let model = Curve::new(["a", "b", "c"], [1.0, 2.0], |x, p, g| {
        g.copy_from_slice(&[1.0, x, x * x]);
        p[0] + x * (p[1] + x * p[2])
    });
    let error = LeastSquares::new(&model, &[1.0, 2.0]).unwrap().solve(&[0.0; 3]).unwrap_err();
    let FitError::TooFewData { data: 2, parameters: 3, null_space } = &error else { panic!("{error}") };
    // 2 - 3x + x^2 vanishes at both points.
    let changes = &null_space.directions[0].changes;
    assert_eq!((null_space.rank, changes.len()), (2, 3));
    assert!((changes[1].1 + 1.5).abs() < 1e-12 && (changes[2].1 - 0.5).abs() < 1e-12, "{error}");
    assert!(
        error.to_string().contains("2 measured values cannot determine 3 parameters: the Jacobian has rank 2 of 3")
    );
    // A fixed parameter counts no longer, and a value of weight 0 neither.
    let problem = LeastSquares::new(&model, &[1.0, 2.0]).unwrap().bounds("c", 0.0, 0.0).unwrap();
    let fit = problem.solve(&[0.0; 3]).unwrap();
    assert!(fit.status.is_converged() && fit.degrees_of_freedom == 0, "{fit}");
    assert_eq!((fit.residual_variance, fit.covariance()), (None, None));
    assert!(fit.cofactors.is_some());
    let error = problem.weights(&[1.0, 0.0]).unwrap().solve(&[0.0; 3]).unwrap_err();
    assert!(matches!(error, FitError::TooFewData { data: 1, parameters: 2, .. }), "{error}");
}

#[test]
fn scales_of_parameters_do_not_change_the_rank() {
    for scale in [1e-150, 1e-20, 1.0, 1e20, 1e150] {
        let model = Curve::new(["a", "b"], x(), move |x, p, g| {
            g.copy_from_slice(&[scale, x]);
            p[0] * scale + x * p[1]
        });
        let y: Vec<f64> = x().iter().map(|x| 1.0 + 2.0 * x).collect();
        let fit = LeastSquares::new(&model, &y).unwrap().solve(&[0.0, 0.0]).unwrap();
        assert!(fit.status.is_converged() && fit.rank == 2, "{scale}: {fit}");
        assert!((fit.parameters[0] * scale - 1.0).abs() < 1e-12, "{scale}: {fit}");
    }
    // Nearly equal columns: the tolerance decides.
    for (difference, tolerance, rank) in [(1e-6, 1e-10, 2), (1e-12, 1e-10, 1), (1e-6, 1e-4, 1)] {
        let model = Curve::new(["a", "b"], x(), move |x, p, g| {
            let second = x + difference * x * x;
            g.copy_from_slice(&[x, second]);
            p[0] * x + p[1] * second
        });
        let y: Vec<f64> = x().iter().map(|x| 3.0 * x).collect();
        let fit = LeastSquares::new(&model, &y).unwrap().rank_tolerance(tolerance).unwrap().solve(&[1.0, 1.0]).unwrap();
        assert_eq!(fit.rank, rank, "{fit}");
    }
}

#[test]
fn no_parameter_has_an_effect() {
    let model = Curve::new(["a", "b"], x(), |x, _p, g| {
        g.fill(0.0);
        x
    });
    let fit = LeastSquares::new(&model, &[0.0; 12]).unwrap().solve(&[1.0, 2.0]).unwrap();
    let FitStatus::Undetermined(NullSpace { rank: 0, parameters: 2, directions }) = &fit.status else {
        panic!("{fit}")
    };
    assert_eq!((directions.len(), fit.parameters), (2, vec![1.0, 2.0]));
}
