//! Jacobians against differences.

use crate::{FitError, Model};
use nalgebra::DMatrix;

/// How far the Jacobian of a model is from differences of its values, for each parameter: the norm of the difference of
/// the two columns, relative to the norm of the column of differences. Exact Jacobians of smooth models give about 1e-9.
///
/// The differences are central, extrapolated once, with steps of `1e-3 max(|theta_j|, 1e-3)`.
///
/// # Errors
/// A wrong number of parameters, or a model that cannot be evaluated there or nearby.
pub fn jacobian_defect(model: &impl Model, theta: &[f64]) -> Result<Vec<f64>, FitError> {
    let (names, count) = (model.parameter_names(), model.value_count());
    if theta.len() != names.len() {
        let (found, expected) = (theta.len(), names.len());
        return Err(FitError::Count { what: "parameters", found, expected });
    }
    let failed = |theta: &[f64]| {
        let (names, parameters) = (names.clone(), theta.to_vec());
        |failure| FitError::Model { names, parameters, failure }
    };
    let mut jacobian = DMatrix::from_element(count, theta.len(), f64::NAN);
    let mut values = vec![f64::NAN; count];
    model.evaluate(theta, &mut values, Some(&mut jacobian)).map_err(failed(theta))?;
    let at = |j: usize, change: f64| {
        let mut moved = theta.to_vec();
        moved[j] += change;
        let mut values = vec![f64::NAN; count];
        model.evaluate(&moved, &mut values, None).map_err(failed(&moved)).map(|()| values)
    };
    let mut defects = Vec::with_capacity(theta.len());
    for (j, column) in jacobian.column_iter().enumerate() {
        let step = 1e-3 * theta[j].abs().max(1e-3);
        let [far_below, below, above, far_above] =
            [at(j, -2.0 * step)?, at(j, -step)?, at(j, step)?, at(j, 2.0 * step)?];
        let (mut difference, mut size) = (0.0, 0.0);
        for (i, derivative) in column.iter().enumerate() {
            let near = 8.0 * (above[i] - below[i]) - (far_above[i] - far_below[i]);
            let quotient = near / (12.0 * step);
            difference += (derivative - quotient) * (derivative - quotient);
            size += quotient * quotient;
        }
        defects.push(if size == 0.0 { f64::sqrt(difference) } else { f64::sqrt(difference / size) });
    }
    Ok(defects)
}
