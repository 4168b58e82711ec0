//! Bounds that are active at the solution, at the start, on the way, or everywhere.

use herglotz_fit::{Bound, Criterion, Curve, Fit, FitStatus, LeastSquares};

/// A line and a parabola: linear in its parameters, so that the bounded solution is known by enumeration.
fn parabola() -> Curve<impl Fn(f64, &[f64], &mut [f64]) -> f64> {
    let points = (0..9).map(|i| f64::from(i) / 4.0);
    Curve::new(["a", "b", "c"], points, |x, p, g| {
        g.copy_from_slice(&[1.0, x, x * x]);
        p[0] + x * (p[1] + x * p[2])
    })
}

fn data(p: [f64; 3]) -> Vec<f64> {
    // With deviations that no parabola has.
    (0..9)
        .map(|i| (f64::from(i) / 4.0, 0.1 * f64::from(i % 3)))
        .map(|(x, e)| p[0] + x * (p[1] + x * p[2]) + e)
        .collect()
}

/// The conditions of Karush, Kuhn and Tucker.
fn assert_is_minimum(fit: &Fit, lower: &[f64], upper: &[f64]) {
    let gradient = fit.jacobian.tr_mul(&fit.residuals);
    let scale = fit.residuals.norm();
    // The square root of the tolerance of the cost is 1e-7; the next step, which is not taken, would be quadratic.
    for i in 0..fit.parameters.len() {
        let size = 1e-7 * scale * fit.jacobian.column(i).norm();
        match fit.at_bounds[i] {
            None => assert!(gradient[i].abs() <= size, "{fit}\n{gradient}"),
            Some(Bound::Lower) => assert!(fit.parameters[i] == lower[i] && gradient[i] >= -size, "{fit}"),
            Some(Bound::Upper) => assert!(fit.parameters[i] == upper[i] && gradient[i] <= size, "{fit}"),
            Some(Bound::Fixed) => assert!(fit.parameters[i] == lower[i] && lower[i] == upper[i], "{fit}"),
        }
        assert!((lower[i]..=upper[i]).contains(&fit.parameters[i]));
    }
}

#[test]
fn all_faces_of_a_box_from_all_of_its_corners() {
    let model = parabola();
    // The unconstrained minimum is moved to all sides of the unit cube.
    for case in 0..27 {
        let side = [case % 3, case / 3 % 3, case / 9].map(|s| [-1.3, 0.4, 2.1][s]);
        let y = data(side);
        let mut costs = Vec::new();
        for corner in 0..9 {
            let start = if corner == 8 { [0.5; 3] } else { [0, 1, 2].map(|k| f64::from(corner >> k & 1)) };
            let mut problem = LeastSquares::new(&model, &y).unwrap();
            for name in ["a", "b", "c"] {
                problem = problem.bounds(name, 0.0, 1.0).unwrap();
            }
            let fit = problem.solve(&start).unwrap();
            assert!(fit.status.is_converged(), "{case} {corner} {fit}");
            assert_is_minimum(&fit, &[0.0; 3], &[1.0; 3]);
            assert!(fit.evaluations < 40, "{case} {corner} {fit}");
            costs.push(fit.cost);
        }
        assert!(costs.iter().all(|c| (c / costs[0] - 1.0).abs() < 1e-12), "{costs:?}");
    }
}

#[test]
fn a_bound_that_is_active_at_the_solution_of_a_nonlinear_fit() {
    let x: Vec<f64> = (0..20).map(|i| f64::from(i) * 0.2).collect();
    let model = Curve::new(["amplitude", "rate", "offset"], x.clone(), |x, p, g| {
        let e = (-p[1] * x).exp();
        g.copy_from_slice(&[e, -p[0] * x * e, 1.0]);
        p[0] * e + p[2]
    });
    let y: Vec<f64> = x.iter().map(|x| 2.0 * (-1.5 * x).exp() - 0.1).collect();
    let problem = LeastSquares::new(&model, &y).unwrap();
    // Offsets are not negative: it is held at 0, and the others are those of a fit without it.
    let bounded = problem.clone().bounds("offset", 0.0, f64::INFINITY).unwrap().solve(&[1.0, 1.0, 0.5]).unwrap();
    assert!(bounded.status.is_converged(), "{bounded}");
    assert_eq!((bounded.parameters[2], bounded.at_bounds[2]), (0.0, Some(Bound::Lower)));
    assert_is_minimum(&bounded, &[f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0], &[f64::INFINITY; 3]);
    let fixed = problem.clone().bounds("offset", 0.0, 0.0).unwrap().solve(&[1.0, 1.0, 0.0]).unwrap();
    assert_eq!(fixed.at_bounds[2], Some(Bound::Fixed));
    for i in 0..2 {
        assert!((bounded.parameters[i] / fixed.parameters[i] - 1.0).abs() < 1e-7);
        let (a, b) = (bounded.standard_errors()[i].unwrap(), fixed.standard_errors()[i].unwrap());
        assert!((a / b - 1.0).abs() < 1e-7);
    }
    assert_eq!(bounded.standard_error("offset"), None);
    assert_eq!((bounded.rank, bounded.degrees_of_freedom), (2, 18));
    assert_eq!(bounded.correlation().unwrap()[(0, 2)], 0.0);
    assert!(bounded.to_string().contains("offset    = 0.000000000000e0 at its lower bound"), "{bounded}");
    // The bound is not active where the minimum is within.
    let free = problem.bounds("offset", -0.2, 0.2).unwrap().solve(&[1.0, 1.0, 0.2]).unwrap();
    assert_eq!(free.at_bounds, [None; 3]);
    assert!((free.parameters[2] + 0.1).abs() < 1e-12, "{free}");
}

#[test]
fn the_model_is_never_evaluated_outside() {
    let x: Vec<f64> = (1..20).map(f64::from).collect();
    // The root is not defined for negative numbers: an evaluation there is NaN, which would be counted as a failure.
    let model = Curve::new(["p"], x.clone(), |x, p, g| {
        assert!((0.01..=4.0).contains(&p[0]), "evaluated at {}", p[0]);
        g[0] = 0.5 * x / p[0].sqrt();
        x * p[0].sqrt()
    });
    for target in [-1.0, 0.05, 1.0, 1.9, 5.0] {
        let y: Vec<f64> = x.iter().map(|x| target * x).collect();
        let fit = LeastSquares::new(&model, &y).unwrap().bounds("p", 0.01, 4.0).unwrap().solve(&[3.9]).unwrap();
        let expected = if target < 0.0 { 0.01 } else { (target * target).clamp(0.01, 4.0) };
        assert!((fit.parameters[0] - expected).abs() < 1e-12, "{target}: {fit}");
    }
}

#[test]
fn all_parameters_at_bounds() {
    let model = parabola();
    let y = data([5.0, 5.0, 5.0]);
    let mut problem = LeastSquares::new(&model, &y).unwrap();
    for name in ["a", "b", "c"] {
        problem = problem.bounds(name, -1.0, 1.0).unwrap();
    }
    let fit = problem.solve(&[1.0; 3]).unwrap();
    assert_eq!(fit.status, FitStatus::Converged(Criterion::AllAtBounds));
    assert_eq!((fit.at_bounds.as_slice(), fit.rank), ([Some(Bound::Upper); 3].as_slice(), 0));
    assert_eq!(problem.solve(&[-1.0; 3]).unwrap().parameters, [1.0; 3]);
}
