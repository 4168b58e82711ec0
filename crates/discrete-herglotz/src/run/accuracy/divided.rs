//! Steps of varying size for a requested accuracy, if equal steps would be too many.

use crate::resolution::thresholds::MIN_COMPARED_DEFECT;
use crate::run::accuracy::comparison_grid::ComparisonGrid;
use crate::run::accuracy::failure::cause_of_disagreement;
use crate::run::accuracy::first_guess::first_guess;
use crate::run::accuracy::limits::{
    DIVIDED_STAGES, DIVIDED_STEPS, MAX_DISTANCE_OF_DIVISIONS, MAX_DIVISIONS, MAX_PART_DEFECT, NEGLIGIBLE_DEFECT,
    PART_DEFECT_PER_ROOT,
};
use crate::run::accuracy::track::Track;
use crate::run::accuracy::trial_end::TrialEnd;
use crate::run::accuracy::trial_runs::TrialRuns;
use crate::run::request::StepSelection;
use crate::switching::DividedGauss;
use crate::{InputError, SelectionFailure};
use contact_geom::numbers::max_or_nan;

/// Selects steps that are divided where the motion is fast, so that the errors of (q, p) and v are at most the
/// requested error: a division and one with parts of half the size must agree. The error of a part is about the square
/// of its defect, and halving a part divides its defect by `2^s`.
pub(crate) fn divided_steps<'p>(trials: &mut TrialRuns<'_, 'p>) -> Result<StepSelection<'p>, InputError> {
    let (wanted, t0, span) = (trials.wanted, trials.request.problem.t0, trials.request.span);
    let finer = f64::powi(0.5, DIVIDED_STAGES as i32);
    let count = first_guess(trials.request, DIVIDED_STAGES, wanted).clamp(DIVIDED_STEPS[0], DIVIDED_STEPS[1]);
    let grid = ComparisonGrid::of(count);
    let mut max_defect = (PART_DEFECT_PER_ROOT * wanted.sqrt()).min(MAX_PART_DEFECT);
    let (mut best, mut before, mut cause) = (f64::INFINITY, f64::NAN, SelectionFailure::Budget);
    let mut coarse: Option<Track> = None;
    // The coarser of the last two runs, and the order that both show.
    let mut last: Option<(DividedGauss, Track, f64)> = None;
    for _ in 0..MAX_DIVISIONS {
        let integrator = DividedGauss { stages: DIVIDED_STAGES, max_defect };
        let mut track =
            |max_defect: f64| match trials.divided(DividedGauss { max_defect, ..integrator }, count, &grid)? {
                TrialEnd::Completed(track) => Ok(Ok(track)),
                TrialEnd::StepFailed { part, cause } => {
                    Ok(Err(SelectionFailure::StepFailed { t: t0 + part * span, cause }))
                }
                _ => Ok::<_, InputError>(Err(SelectionFailure::Budget)),
            };
        let first = match coarse.take() {
            Some(track) => Ok(track),
            None => track(max_defect)?,
        };
        let tracks = match first {
            Ok(first) => track(max_defect * finer)?.map(|second| (first, second)),
            Err(failure) => Err(failure),
        };
        let (first, second) = match tracks {
            Ok(tracks) => tracks,
            Err(failure) => {
                cause = failure;
                break;
            }
        };
        let error = max_or_nan(first.distance(&second), 0.5 * f64::EPSILON);
        // Equal runs, of the same parts, compare nothing: the defect of these must be negligible.
        let negligible = max_or_nan(NEGLIGIBLE_DEFECT * wanted, MIN_COMPARED_DEFECT);
        let compared = first.distance(&second) > 0.0 || max_defect * finer <= negligible;
        if compared && error <= MAX_DISTANCE_OF_DIVISIONS * wanted {
            let repeat = |trials: &mut TrialRuns<'_, 'p>| trials.divided(integrator, count, &grid);
            let last_digit = trials.error_of_last_digit([&first, &second], repeat)?;
            let (h, error) = (span / count as f64, Some(max_or_nan(error, last_digit)));
            return Ok(StepSelection::new(trials.collocation.divided_gauss(integrator), count, h, error));
        }
        let distances = first.distances(&second);
        let order = f64::log2(before / error);
        cause = cause_of_disagreement(&distances, order, wanted, t0, span);
        last = Some((integrator, first, order));
        (best, before) = (best.min(error), error);
        max_defect *= finer;
        if max_defect < MIN_COMPARED_DEFECT {
            break;
        }
        coarse = Some(second);
    }
    if let Some((integrator, first, order)) = last {
        let repeat = |trials: &mut TrialRuns<'_, 'p>| trials.divided(integrator, count, &grid);
        cause = trials.tested_cause(cause, (count, &first, order), repeat)?;
    }
    Err(InputError::Accuracy { wanted, reached: best, cause })
}
