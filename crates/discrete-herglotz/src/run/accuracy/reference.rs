//! Step-size selection for any integrator, by comparison with a reference solution.

use crate::run::accuracy::converge::{Converged, MAX_SEARCHES, chosen};
use crate::run::accuracy::trial_runs::{TrialEnd, TrialRuns};
use crate::run::request::{MOST_STEPS, Shared, StepSelection};
use crate::{InputError, SelectionFailure};
use contact_geom::Lagrangian;

/// The number of stages of the reference for other methods.
pub(crate) const REFERENCE_STAGES: usize = 12;

/// The steps of any integrator for the requested error, from runs that are compared with the reference.
pub(crate) fn by_reference<'p, L: Lagrangian<N>, const N: usize>(
    trials: &mut TrialRuns<'_, 'p, L, N>,
    integrator: &Shared<'p, L, N>,
    found: &Converged<N>,
) -> Result<StepSelection<'p, L, N>, InputError> {
    let wanted = trials.wanted;
    let (order, marks) = (f64::from(integrator.info().order), &found.marks);
    let whole = |count: f64| marks.whole(count);
    let refuse = |reached, cause| Err(InputError::Accuracy { wanted, reached, cause });
    let mut count = whole((found.k * REFERENCE_STAGES) as f64 / order.min(4.0));
    let (mut best, mut strikes) = (f64::INFINITY, 0);
    let (mut cause, mut before) = (SelectionFailure::Budget, None);
    // The smallest number of steps that was found to be sufficient, with its error.
    let mut enough: Option<(usize, f64)> = None;
    for _ in 0..MAX_SEARCHES {
        if count as f64 > MOST_STEPS {
            break;
        }
        let factor = match trials.own(integrator, count, marks)? {
            TrialEnd::Followed(track) => {
                let error = track.distance(&found.truth);
                if error <= 0.7 * wanted {
                    enough = Some((count, error));
                    // Fewer steps are tried if the order predicts that far fewer are sufficient.
                    let fewer = whole(count as f64 * (error / (0.5 * wanted)).powf(1.0 / order).max(1.0 / 16.0));
                    if error > 0.2 * wanted || fewer as f64 > 0.8 * count as f64 || strikes > 0 {
                        break;
                    }
                    count = fewer;
                    continue;
                }
                if enough.is_some() {
                    break;
                }
                strikes = if error < 0.7 * best { 0 } else { strikes + 1 };
                // The reference has converged, so the cause is not chaos.
                if let Some((n, other)) = before.replace((count, error)) {
                    let shown = f64::ln(other / error) / f64::ln(count as f64 / n as f64);
                    let round_off = error < 1e-9 && shown < 0.5 * order;
                    cause =
                        if round_off { SelectionFailure::RoundOff } else { SelectionFailure::Order { order: shown } };
                }
                best = best.min(error);
                if strikes == 4 {
                    break;
                }
                if error.is_finite() {
                    (1.05 * (error / (0.5 * wanted)).powf(1.0 / order)).clamp(1.2, 32.0)
                } else {
                    2.0
                }
            }
            TrialEnd::Halted { part, cause: halt } => {
                if enough.is_some() {
                    break;
                }
                cause =
                    SelectionFailure::Halted { t: trials.request.problem.t0 + part * trials.request.span, cause: halt };
                2.0
            }
            _ => {
                cause = SelectionFailure::Budget;
                break;
            }
        };
        count = whole(count as f64 * factor);
    }
    match enough {
        Some((count, error)) => Ok(chosen(trials, integrator, count, error, found)),
        None => refuse(best, cause),
    }
}
