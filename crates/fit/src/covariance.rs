//! The variance of the residuals.

use crate::residuals::{Evaluation, Residuals};

/// The factor s^2 of the covariance `s^2 (J^T J)^-1`; `None` without degrees of freedom, and where the loss of the
/// residuals has no mean curvature.
///
/// For least squares s^2 is the sum of squares divided by the degrees of freedom. For a robust loss with influence
/// `psi = rho' r` it is `K^2 (sum psi^2/(m - n)) / (mean psi')^2` with `K = 1 + (n/m) var(psi')/(mean psi')^2` (Huber,
/// Robust Statistics, 1981, section 7.6), which outliers do not inflate.
pub(crate) fn residual_variance<M>(residuals: &Residuals<'_, M>, at: &Evaluation, free: usize) -> Option<f64> {
    // Each constraint determines one parameter.
    let (data, parameters) = (at.residuals.len() - residuals.constraints, free.saturating_sub(residuals.constraints));
    let weighted = at.residuals.iter().zip(&residuals.weights).take(data).filter(|(_, weight)| **weight > 0.0);
    let terms: Vec<_> = weighted.map(|(r, _)| residuals.loss.term(*r)).collect();
    let degrees_of_freedom = terms.len().checked_sub(parameters).filter(|d| *d > 0)?;
    let mean = |f: &dyn Fn(f64) -> f64| terms.iter().map(|t| f(t.influence_slope)).sum::<f64>() / terms.len() as f64;
    let curvature = mean(&|slope| slope);
    let variance = mean(&|slope| (slope - curvature).powi(2));
    let squares: f64 = terms.iter().map(|t| t.influence * t.influence).sum();
    let correction = 1.0 + parameters as f64 / terms.len() as f64 * variance / (curvature * curvature);
    let result = squares / degrees_of_freedom as f64 * (correction / curvature).powi(2);
    (curvature > 0.0 && result.is_finite()).then_some(result)
}
