//! A fit: iterations over the free parameters, with an active set of bounds.

use crate::bounds::Bounds;
use crate::covariance::residual_variance;
use crate::minimizer::{End, Progress, minimize};
use crate::null_space::ScaledSvd;
use crate::residuals::{Evaluation, Residuals};
use crate::settings::Settings;
use crate::{Bound, Criterion, Fit, FitError, FitStatus, Model};
use nalgebra::DMatrix;
use std::rc::Rc;

pub(crate) fn solve<M: Model>(
    residuals: &Residuals<'_, M>,
    bounds: &Bounds,
    settings: &Settings,
    start: &[f64],
) -> Result<Fit, FitError> {
    check(residuals, bounds, start)?;
    let best = residuals.evaluate(start, true).map_err(|failure| residuals.failed(start, failure))?;
    check_data_count(residuals, bounds, settings, &best)?;
    let mut progress = Progress { best: Rc::new(best), evaluations: 1, iterations: 0, is_projected: false };
    let mut held = held_at_bounds(residuals, bounds, &progress.best);
    let end = loop {
        let free: Vec<usize> = (0..start.len()).filter(|i| held[*i].is_none()).collect();
        if free.is_empty() {
            break End::Converged(Criterion::AllAtBounds);
        }
        let end = minimize(residuals, bounds, settings, &free, &mut progress);
        if progress.best.jacobian.is_none() {
            // The last accepted trial was the end.
            let theta = progress.best.theta.clone();
            progress.best = Rc::new(residuals.evaluate(&theta, true).map_err(|f| residuals.failed(&theta, f))?);
        }
        let next = held_at_bounds(residuals, bounds, &progress.best);
        let is_settled = next == held && !progress.is_projected;
        held = next;
        match end {
            End::Converged(_) if !is_settled => {}
            end => break end,
        }
    };
    let status = match end {
        End::Converged(criterion) => FitStatus::Converged(criterion),
        End::EvaluationLimit => FitStatus::EvaluationLimit { limit: settings.limit(start.len()) },
        End::Failed(theta, failure) => return Err(residuals.failed(&theta, failure)),
        End::Numerical(reason) => return Err(numerical(residuals, &progress.best, reason)),
    };
    result(residuals, settings, progress, held, status)
}

/// The parameters at bounds beyond which the cost would decrease.
fn held_at_bounds<M: Model>(residuals: &Residuals<'_, M>, bounds: &Bounds, at: &Evaluation) -> Vec<Option<Bound>> {
    let gradient = residuals.gradient(at);
    let derivative = |i: usize| gradient.as_ref().map_or(0.0, |g| g[i]);
    (0..at.theta.len()).map(|i| bounds.holds(i, at.theta[i], derivative(i))).collect()
}

fn result<M: Model>(
    residuals: &Residuals<'_, M>,
    settings: &Settings,
    progress: Progress,
    held: Vec<Option<Bound>>,
    mut status: FitStatus,
) -> Result<Fit, FitError> {
    let (evaluations, iterations) = (progress.evaluations, progress.iterations);
    let best = progress.best;
    let jacobian = best.jacobian.clone().unwrap_or_default();
    let free: Vec<usize> = (0..held.len()).filter(|i| held[*i].is_none()).collect();
    let svd = free_svd(residuals, settings, &best, &free)?;
    if svd.rank() < free.len() && status.is_converged() {
        let names: Vec<String> = free.iter().map(|i| residuals.names[*i].clone()).collect();
        status = FitStatus::Undetermined(svd.null_space(&names));
    }
    let cofactors = svd.normal_inverse().map(|inverse| {
        let mut all = DMatrix::zeros(held.len(), held.len());
        for (a, i) in free.iter().enumerate() {
            for (b, j) in free.iter().enumerate() {
                all[(*i, *j)] = inverse[(a, b)];
            }
        }
        all
    });
    Ok(Fit {
        names: residuals.names.clone(),
        parameters: best.theta.clone(),
        at_bounds: held,
        status,
        cost: best.cost,
        values: best.values.clone(),
        residuals: best.residuals.clone(),
        jacobian,
        iterations,
        evaluations,
        rank: svd.rank(),
        degrees_of_freedom: residuals.data_count().saturating_sub(free.len()),
        residual_variance: residual_variance(residuals, &best, free.len()),
        absolute_deviations: settings.absolute_deviations,
        cofactors,
    })
}

fn free_svd<M: Model>(
    residuals: &Residuals<'_, M>,
    settings: &Settings,
    at: &Evaluation,
    free: &[usize],
) -> Result<ScaledSvd, FitError> {
    let jacobian = at.jacobian.clone().unwrap_or_default().select_columns(free);
    ScaledSvd::new(jacobian, settings.rank_tolerance)
        .ok_or_else(|| numerical(residuals, at, "the singular values of the Jacobian do not converge".to_owned()))
}

fn numerical<M: Model>(residuals: &Residuals<'_, M>, at: &Evaluation, reason: String) -> FitError {
    FitError::Numerical { names: residuals.names.clone(), parameters: at.theta.clone(), reason }
}

pub(crate) fn check<M: Model>(residuals: &Residuals<'_, M>, bounds: &Bounds, start: &[f64]) -> Result<(), FitError> {
    if start.len() != residuals.names.len() {
        let expected = residuals.names.len();
        return Err(FitError::Count { what: "parameters of the start", found: start.len(), expected });
    }
    for (i, value) in start.iter().enumerate() {
        if !(value.is_finite() && bounds.contains(i, *value)) {
            let (lower, upper) = (bounds.lower[i], bounds.upper[i]);
            return Err(FitError::Start { name: residuals.names[i].clone(), value: *value, lower, upper });
        }
    }
    let mut data = residuals.data.iter().zip(&residuals.weights);
    if let Some(index) = data.position(|(y, w)| !y.is_finite() && *w > 0.0) {
        return Err(FitError::Datum { index, value: residuals.data[index] });
    }
    Ok(())
}

/// Refuses fewer values than parameters, with the null space at the start.
fn check_data_count<M: Model>(
    residuals: &Residuals<'_, M>,
    bounds: &Bounds,
    settings: &Settings,
    start: &Evaluation,
) -> Result<(), FitError> {
    let free: Vec<usize> = (0..start.theta.len()).filter(|i| bounds.lower[*i] < bounds.upper[*i]).collect();
    let data = residuals.data_count();
    if data >= free.len() {
        return Ok(());
    }
    let svd = free_svd(residuals, settings, start, &free)?;
    let names: Vec<String> = free.iter().map(|i| residuals.names[*i].clone()).collect();
    Err(FitError::TooFewData { data, parameters: free.len(), null_space: svd.null_space(&names) })
}
