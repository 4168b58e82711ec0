//! Step-size selection for an integrator under constraints, by runs with twice as many steps each.

use crate::integration::SharedIntegrator;
use crate::run::accuracy::comparison_grid::ComparisonGrid;
use crate::run::accuracy::first_guess::first_guess;
use crate::run::accuracy::limits::{
    COMPARED_PARTS, DEFAULT_STAGES, MAX_DISTANCE_FROM_REFERENCE, MAX_ITERATIONS, MAX_ROUND_OFF, MAX_STAGNATING_RATIO,
    MAX_STAGNATIONS_FROM_REFERENCE, NEGLIGIBLE_DEFECT,
};
use crate::run::accuracy::track::Track;
use crate::run::accuracy::trial_end::TrialEnd;
use crate::run::accuracy::trial_runs::TrialRuns;
use crate::run::request::{MAX_STEPS, StepSelection};
use crate::{InputError, SelectionFailure};
use contact_geom::numbers::max_or_nan;

/// The steps of an integrator for the requested error, without a reference: three runs, each with twice as many steps as
/// the one before, must agree better and better, at least as with half the order of the method. The distance of two runs
/// is then the error of the coarser one.
pub(crate) fn by_doubled_steps<'p>(
    trials: &mut TrialRuns<'_, 'p>,
    integrator: &SharedIntegrator<'p>,
) -> Result<StepSelection<'p>, InputError> {
    let (wanted, order, grid) =
        (trials.wanted, f64::from(integrator.info().order), ComparisonGrid::equal(COMPARED_PARTS));
    // Half the order, so that the start of the asymptotic range is not missed.
    let decrease = f64::powf(2.0, 0.5 * order);
    let goal = MAX_DISTANCE_FROM_REFERENCE * wanted;
    let selected = |count: usize, error: f64| {
        StepSelection::new(integrator.clone(), count, trials.request.span / count as f64, Some(error))
    };
    let mut count = grid.whole(first_guess(trials.request, DEFAULT_STAGES, wanted) as f64);
    let (mut known, mut before, mut best, mut stagnations): (Option<Track>, _, _, _) =
        (None, f64::INFINITY, f64::INFINITY, 0);
    let mut cause = SelectionFailure::Budget;
    // The steps for which three runs in a row differ least.
    let mut nearest = (f64::INFINITY, 0);
    for _ in 0..MAX_ITERATIONS {
        if count as f64 > MAX_STEPS {
            break;
        }
        match trials.with_integrator(integrator, count, &grid)? {
            TrialEnd::Completed(track) => {
                let apart = known.as_ref().map_or(f64::INFINITY, |coarser| coarser.distance(&track));
                known = Some(track);
                let agree = before.is_finite() && before >= decrease * apart;
                // Runs that differ by round-off alone do not agree better and better.
                if agree || before.max(apart) <= NEGLIGIBLE_DEFECT * wanted {
                    if apart <= goal {
                        return Ok(selected(count / 2, apart));
                    }
                    if apart <= decrease * goal {
                        return Ok(selected(count, apart / decrease));
                    }
                }
                if before.is_finite() && !agree {
                    stagnations += usize::from(apart > MAX_STAGNATING_RATIO * best);
                    let shown = f64::log2(before / apart);
                    let round_off = apart < MAX_ROUND_OFF && shown < 0.5 * order;
                    cause =
                        if round_off { SelectionFailure::RoundOff } else { SelectionFailure::Order { order: shown } };
                }
                let of_three = max_or_nan(before, apart);
                nearest = if of_three < nearest.0 { (of_three, count) } else { nearest };
                (best, before) = (best.min(apart), apart);
                if stagnations == MAX_STAGNATIONS_FROM_REFERENCE {
                    break;
                }
            }
            TrialEnd::StepFailed { part, cause: failure } => {
                let t = trials.request.problem.t0 + part * trials.request.span;
                (known, before) = (None, f64::INFINITY);
                cause = SelectionFailure::StepFailed { t, cause: failure };
            }
            _ => {
                cause = SelectionFailure::Budget;
                break;
            }
        }
        count *= 2;
    }
    // Runs that differ by round-off do not agree better and better, but this is their error.
    match nearest {
        (error, count) if error <= wanted => Ok(selected(count, error)),
        _ => Err(InputError::Accuracy { wanted, reached: best, cause }),
    }
}
