//! Step-size selection for any integrator, by comparison with a reference solution.

use crate::integration::SharedIntegrator;
use crate::run::accuracy::converge::{Converged, selected};
use crate::run::accuracy::limits::{
    FACTOR_AFTER_FAILURE, FEWER_STEPS, MAX_DISTANCE_FROM_REFERENCE, MAX_ITERATIONS, MAX_ROUND_OFF,
    MAX_STAGNATING_RATIO, MAX_STAGNATIONS_FROM_REFERENCE, MIN_DISTANCE_FROM_REFERENCE, MORE_STEPS,
    PREDICTED_DISTANCE_FROM_REFERENCE, PREDICTION_MARGIN, REFERENCE_ERROR, REFERENCE_STAGES,
};
use crate::run::accuracy::trial_end::TrialEnd;
use crate::run::accuracy::trial_runs::TrialRuns;
use crate::run::request::{MAX_STEPS, StepSelection};
use crate::{InputError, SelectionFailure};

/// The steps of any integrator for the requested error, from runs that are compared with the reference.
pub(crate) fn by_reference<'p>(
    trials: &mut TrialRuns<'_, 'p>,
    integrator: &SharedIntegrator<'p>,
    found: &Converged,
) -> Result<StepSelection<'p>, InputError> {
    let wanted = trials.wanted;
    let (order, grid) = (f64::from(integrator.info().order), &found.grid);
    let whole = |count: f64| grid.whole(count);
    let goal = PREDICTED_DISTANCE_FROM_REFERENCE * wanted;
    let refuse = |reached, cause| Err(InputError::Accuracy { wanted, reached, cause });
    let mut count = whole((found.k * REFERENCE_STAGES) as f64 / order.min(4.0));
    // The smallest distance from the reference, and the number of steps with it.
    let (mut best, mut stagnations) = ((f64::INFINITY, 0), 0);
    let (mut cause, mut before) = (SelectionFailure::Budget, None);
    // The smallest number of steps that was found to be sufficient, with its error.
    let mut enough: Option<(usize, f64)> = None;
    for _ in 0..MAX_ITERATIONS {
        if count as f64 > MAX_STEPS {
            break;
        }
        let factor = match trials.with_integrator(integrator, count, grid)? {
            TrialEnd::Completed(track) => {
                let error = track.distance(&found.reference);
                if error <= MAX_DISTANCE_FROM_REFERENCE * wanted {
                    enough = Some((count, error));
                    // Fewer steps are tried if the order predicts that far fewer are sufficient.
                    let factor = (error / goal).powf(1.0 / order).max(FEWER_STEPS[0]);
                    let fewer = whole(count as f64 * factor);
                    let enough_saved = fewer as f64 <= FEWER_STEPS[1] * count as f64;
                    if error > MIN_DISTANCE_FROM_REFERENCE * wanted || !enough_saved || stagnations > 0 {
                        break;
                    }
                    count = fewer;
                    continue;
                }
                if enough.is_some() {
                    break;
                }
                stagnations = if error < MAX_STAGNATING_RATIO * best.0 { 0 } else { stagnations + 1 };
                // The reference has converged, so the cause is not chaos.
                if let Some((n, other)) = before.replace((count, error)) {
                    let shown = f64::ln(other / error) / f64::ln(count as f64 / n as f64);
                    let round_off = error < MAX_ROUND_OFF && shown < 0.5 * order;
                    cause =
                        if round_off { SelectionFailure::RoundOff } else { SelectionFailure::Order { order: shown } };
                }
                best = if error < best.0 { (error, count) } else { best };
                if stagnations == MAX_STAGNATIONS_FROM_REFERENCE {
                    break;
                }
                if error.is_finite() {
                    (PREDICTION_MARGIN * (error / goal).powf(1.0 / order)).clamp(MORE_STEPS[0], MORE_STEPS[1])
                } else {
                    FACTOR_AFTER_FAILURE
                }
            }
            TrialEnd::StepFailed { part, cause: failure } => {
                if enough.is_some() {
                    break;
                }
                cause = SelectionFailure::StepFailed {
                    t: trials.request.problem.t0 + part * trials.request.span,
                    cause: failure,
                };
                FACTOR_AFTER_FAILURE
            }
            _ => {
                cause = SelectionFailure::Budget;
                break;
            }
        };
        count = whole(count as f64 * factor);
    }
    // With the error of the reference, at the level of round-off too.
    let reached = best.0 + REFERENCE_ERROR * wanted;
    match enough.or((reached <= wanted).then_some((best.1, reached))) {
        Some((count, error)) => Ok(selected(trials, integrator, count, error, found)),
        None => refuse(reached, cause),
    }
}
