//! The factorisations of large matrices by nalgebra and by faer, on the same systems.

use super::{CROSSOVER, nalgebra_lu};
use crate::StepError;
use crate::solve::inverse::inverse;
use contact_geom::nalgebra::DMatrix;
use contact_geom::numbers::max_abs_or_nan;

/// Solves two systems with the same workspace: the second with the first solution as the right-hand side.
type Solve = fn([&DMatrix<f64>; 2], &mut [f64]) -> [Result<(), StepError>; 2];

/// The steps of a [`Solve`] with the given type of factorisation.
macro_rules! solve_by {
    ($lu:ty) => {
        |systems, b| {
            let mut lu = <$lu>::new(b.len());
            systems.map(|a| lu.factorise(|i, j| a[(i, j)]).and_then(|()| lu.solve(b)))
        }
    };
}

const METHODS: &[(&str, Solve)] = &[
    ("nalgebra", solve_by!(nalgebra_lu::DenseLu)),
    #[cfg(feature = "faer")]
    ("faer", solve_by!(super::faer_lu::DenseLu)),
];

/// Integers between -50 and 50.
fn integer(k: usize) -> f64 {
    (101.0 * (k as f64 * 0.618_033_988_749_894_9).fract()).floor() - 50.0
}

/// The largest sum of absolute values in a row.
fn norm(a: &DMatrix<f64>) -> f64 {
    max_abs_or_nan(a.row_iter().map(|row| row.iter().map(|x| x.abs()).sum::<f64>()))
}

/// Matrices of n rows whose products with integers are exact: with random entries, and with a last row that is the first
/// plus 2^-20 times another.
fn matrices(n: usize) -> [DMatrix<f64>; 2] {
    let random = DMatrix::from_fn(n, n, |i, j| integer((i * n + j).pow(2)));
    let mut near_singular = random.clone();
    for j in 0..n {
        near_singular[(n - 1, j)] = random[(0, j)] + random[(n / 2, j)] * 2f64.powi(-20);
    }
    [random, near_singular]
}

/// The residual is within `n eps |A| |x|` and the error within `n eps` times the condition, for sizes on both sides of
/// the crossover; hence so is the difference between the methods. Both bounds allow for a growth of the pivots by n.
#[test]
fn both_factorisations_solve_to_round_off() {
    for n in [1, 2, CROSSOVER - 1, CROSSOVER, 2 * CROSSOVER + 1, 96] {
        let unit = DMatrix::identity(n, n);
        for (which, a) in matrices(n).into_iter().enumerate() {
            let x: Vec<f64> = (0..n).map(|k| integer(7 * k + 3)).collect();
            let size = max_abs_or_nan(x.iter().copied());
            let product = |x: &[f64]| -> Vec<f64> { (0..n).map(|i| (0..n).map(|j| a[(i, j)] * x[j]).sum()).collect() };
            let b = product(&x);
            let condition = norm(&a) * norm(&inverse(&a).unwrap());
            let unit_of_round_off = n as f64 * f64::EPSILON;
            let mut solutions = Vec::new();
            for (name, solve) in METHODS {
                let mut found = b.clone();
                assert_eq!(solve([&a, &unit], &mut found), [Ok(()), Ok(())], "{name}, {n}");
                let residual = max_abs_or_nan(product(&found).iter().zip(&b).map(|(x, y)| x - y));
                let bound = unit_of_round_off * norm(&a) * size;
                assert!(residual <= bound, "{name}, {n}, matrix {which}: residual {residual:e}, {bound:e}");
                let error = max_abs_or_nan(found.iter().zip(&x).map(|(x, y)| x - y));
                let bound = unit_of_round_off * condition * size;
                assert!(error <= bound, "{name}, {n}, matrix {which}: error {error:e}, {bound:e}");
                solutions.push(found);
            }
            for solution in &solutions {
                let apart = max_abs_or_nan(solution.iter().zip(&solutions[0]).map(|(x, y)| x - y));
                assert!(apart <= 2.0 * unit_of_round_off * condition * size, "{n}, matrix {which}: {apart:e}");
            }
        }
    }
}

/// A column of zeros and a number that is not finite are reported, and leave the workspace usable.
#[test]
fn singular_matrices_are_reported() {
    for n in [2, CROSSOVER, 2 * CROSSOVER + 1] {
        let [regular, _] = matrices(n);
        for (what, value) in [("zeros", 0.0), ("NaN", f64::NAN)] {
            let mut singular = regular.clone();
            if value == 0.0 {
                singular.column_mut(n / 2).fill(value);
            } else {
                singular[(n / 2, 0)] = value;
            }
            for (name, solve) in METHODS {
                let mut b = vec![1.0; n];
                let [refused, next] = solve([&singular, &regular], &mut b);
                assert!(matches!(refused, Err(StepError::Singular { .. })), "{name}, {n}, {what}: {refused:?}");
                assert_eq!(next, Ok(()), "{name}, {n}, {what}");
            }
        }
    }
}
