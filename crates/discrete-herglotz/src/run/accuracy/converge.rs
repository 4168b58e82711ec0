//! The reference solution: runs with k and 2k steps of contact Gauss collocation that agree.

use crate::integration::SharedIntegrator;
use crate::resolution::thresholds::MIN_COMPARED_DEFECT;
use crate::run::accuracy::comparison_grid::ComparisonGrid;
use crate::run::accuracy::failure::cause_of_disagreement;
use crate::run::accuracy::first_guess::first_guess;
use crate::run::accuracy::last_digit::growth_of_distances;
use crate::run::accuracy::limits::{
    ERROR_ORDER_OF_SMOOTH_MOTIONS, ERROR_ORDER_PER_DEFECT_ORDER, LONG_SEARCH_STEPS, MAX_DEFECT_ORDER,
    MAX_DISTANCE_OF_AGREEING_RUNS, MAX_DISTANCE_OF_ONE_TIME, MAX_FAILURES_AT_ONE_TIME, MAX_ITERATIONS, MAX_NARROW_RUNS,
    MAX_NEWTON_RUNS, MAX_OF_ITERATIONS, MAX_PREDICTED_ERROR, MAX_PREDICTIVE_DISTANCE, MAX_REGULAR_GROWTH,
    MAX_STAGNATIONS, MIN_ASYMPTOTIC_RATIO, MIN_DEFECT_ORDER, MIN_RATIO_FOR_DIVISION, NEGLIGIBLE_DEFECT, OF_ITERATIONS,
    PREDICTION_RANGE, PREDICTION_REDUCTION, ROUND_OFF_OF_A_STEP,
};
use crate::run::accuracy::pair::Pairs;
use crate::run::accuracy::track::Track;
use crate::run::accuracy::trial_end::{SwitchReason, TrialEnd};
use crate::run::accuracy::trial_runs::TrialRuns;
use crate::run::request::{MAX_STEPS, StepSelection};
use crate::{InputError, SelectionFailure};
use contact_geom::numbers::max_or_nan;

/// A motion on which runs with k and with more steps agree.
pub(crate) struct Converged {
    pub k: usize,
    /// The number of steps of the finer run.
    pub finer: usize,
    /// The error of the run with k steps, and the predicted error of the finer run.
    pub errors: [f64; 2],
    /// The error that a change of the last digit of the start causes, if it was measured; otherwise 0.
    pub last_digit: f64,
    /// The largest defect between the nodes of the run with k steps, and the order with which it decreases, half the
    /// order of the error.
    pub defect: f64,
    pub order: f64,
    /// Whether the finer run costs less: its fixed-point iterations converge, where longer steps need Newton's
    /// method.
    pub finer_is_cheaper: bool,
    pub reference: Track,
    pub grid: ComparisonGrid,
    /// Whether the search found a narrow feature, defects that do not decrease like those of a smooth motion, or distances that
    /// grow as in a chaotic motion: the errors of other numbers of steps cannot be predicted.
    pub irregular: bool,
}

/// The end of a search without two runs that agree.
pub(crate) enum Ended {
    Refused(InputError),
    /// Another integrator is less expensive; `otherwise` is the error if no other one is taken.
    Switch {
        reason: SwitchReason,
        otherwise: InputError,
    },
}

impl From<InputError> for Ended {
    fn from(refused: InputError) -> Self {
        Ended::Refused(refused)
    }
}

impl From<Ended> for InputError {
    fn from(ended: Ended) -> Self {
        match ended {
            Ended::Refused(refused) | Ended::Switch { otherwise: refused, .. } => refused,
        }
    }
}

/// The times at which trial runs are compared.
#[derive(Clone, Copy)]
pub(crate) enum Compared {
    /// At the ends of the steps that contain the tenths of the span.
    Steps,
    /// At tenths of the span, which are ends of steps of every run.
    Tenths,
    /// At tenths of the span; the runs are in the transformed time of the Lagrangian.
    Times,
}

/// The selection of a number of steps that fill the span; in transformed time their number is computed from the span of
/// tau.
pub(crate) fn selected<'p>(
    trials: &TrialRuns<'_, 'p>,
    integrator: &SharedIntegrator<'p>,
    count: usize,
    error: f64,
    found: &Converged,
) -> StepSelection<'p> {
    let error = Some(max_or_nan(error, found.last_digit));
    let (h, integrator) = (trials.step(count, &found.grid), integrator.clone());
    if let ComparisonGrid::Times = found.grid {
        // The last step is about half as long as the others, so that round-off does not add a step.
        let count = (found.reference.tau / h + 0.5).ceil().max(1.0);
        return StepSelection::new(integrator, count as usize, found.reference.tau / (count - 0.5), error);
    }
    StepSelection::new(integrator, count, h, error)
}

/// Refines the steps until two runs agree. Of a smooth motion runs with numbers of steps in the ratio 2 : 3 are compared
/// first; if this does not succeed, all motions are searched in the same way.
pub(crate) fn converge(
    trials: &mut TrialRuns<'_, '_>,
    stages: usize,
    goal: f64,
    compared: Compared,
) -> Result<Converged, Ended> {
    if matches!(compared, Compared::Steps) && trials.is_smooth()? {
        let found = search(trials, stages, goal, compared, true);
        if !matches!(found, Err(Ended::Refused(InputError::Accuracy { .. }))) {
            return found;
        }
        trials.samples_all_steps = true;
    }
    search(trials, stages, goal, compared, false)
}

/// Refines the steps until two runs agree.
fn search(
    trials: &mut TrialRuns<'_, '_>,
    stages: usize,
    goal: f64,
    compared: Compared,
    smooth: bool,
) -> Result<Converged, Ended> {
    let (wanted, t0, span) = (trials.wanted, trials.request.problem.t0, trials.request.span);
    let failed = |reached, cause| InputError::Accuracy { wanted, reached, cause };
    let s = stages as f64;
    let goal_of_first = Pairs::goal_of_first(smooth, stages, goal);
    let grid_of = |k: usize, pairs: Pairs| match compared {
        Compared::Steps => ComparisonGrid::of(pairs.base(k)),
        Compared::Tenths => ComparisonGrid::equal(k),
        Compared::Times => ComparisonGrid::Times,
    };
    // Of motions that are known to be smooth the runs converge as their order says, whatever a small error of their steps.
    let loose = smooth && matches!(compared, Compared::Steps) && !trials.request.needs.derivatives;
    trials.of_iterations = if loose { OF_ITERATIONS * goal } else { 0.0 };
    let mut k = first_guess(trials.request, stages, goal_of_first);
    let first = k.max(LONG_SEARCH_STEPS / MIN_RATIO_FOR_DIVISION);
    let mut pairs = Pairs::of(smooth, k, stages, goal);
    let mut grid = grid_of(k, pairs);
    // The number of runs that ended because of Newton's method.
    let mut newton_runs = 0;
    // The number of steps of the next run, if that before it is known; whether it may be smaller. In general the iteration
    // does not converge for steps that are longer than the first guess.
    let (mut next, mut may_be_coarser) = (None, trials.request.iterates_accelerations());
    let (mut best, mut stagnations, mut narrow_features, mut failures) = (f64::INFINITY, 0, 0, (0, 0.0));
    // The smallest distance of two runs, regardless of a third one; and the reason why they do not agree.
    let (mut nearest, mut cause) = (f64::INFINITY, SelectionFailure::Budget);
    // The finer of the last two runs, and their distance.
    let (mut known, mut before): (Option<Track>, f64) = (None, f64::NAN);
    let (mut predicted, mut irregular) = (false, false);
    // The coarser of the last two runs, its number of steps, and the order that both show.
    let mut last: Option<(usize, Track, f64)> = None;
    'search: for _ in 0..MAX_ITERATIONS {
        if 2.0 * k as f64 > MAX_STEPS {
            break;
        }
        if known.is_none() {
            pairs = Pairs::of(smooth, k, stages, goal);
            grid = grid_of(k, pairs);
            k = pairs.first(&grid).unwrap_or_else(|| grid.whole(k as f64));
        }
        let left = trials.reserve;
        let mut tracks = Vec::with_capacity(2);
        let mut second = 2 * k;
        for is_second in [false, true] {
            if let Some(track) = known.take() {
                second = next.take().unwrap_or_else(|| pairs.second(&grid, k, track.defect, may_be_coarser));
                tracks.push(track);
                continue;
            }
            let count = if is_second { second } else { k };
            trials.ends_at_newton_steps = smooth && newton_runs < MAX_NEWTON_RUNS;
            let ending = trials.gauss(stages, count, &grid, is_second, narrow_features < MAX_NARROW_RUNS)?;
            let stopped = match ending {
                TrialEnd::Completed(track) => {
                    // The error is about the square of the defect: from a defect that is far too large the number of
                    // steps is predicted, instead of doubled repeatedly.
                    let more = (track.defect.powi(2) / goal_of_first).powf(0.5 / s) / PREDICTION_REDUCTION;
                    if !is_second && !predicted && more > PREDICTION_RANGE[0] {
                        predicted = true;
                        k = (k as f64 * more.min(PREDICTION_RANGE[1])).ceil() as usize;
                        continue 'search;
                    }
                    if !is_second {
                        second = pairs.second(&grid, k, track.defect, may_be_coarser);
                    }
                    tracks.push(track);
                    continue;
                }
                _ if is_second && second < k && !matches!(ending, TrialEnd::Interrupted) => {
                    (known, may_be_coarser) = (tracks.pop(), false);
                    continue 'search;
                }
                TrialEnd::SwitchReason(SwitchReason::FewerStages) if !trials.tests_newton_steps => {
                    newton_runs += 1;
                    (k, next) = (2 * k, None);
                    continue 'search;
                }
                TrialEnd::SwitchReason(reason) => {
                    return Err(Ended::Switch { reason, otherwise: failed(nearest, SelectionFailure::Budget) });
                }
                TrialEnd::Interrupted => return Err(InputError::Interrupted.into()),
                TrialEnd::Exhausted => {
                    let is_specific = matches!(
                        cause,
                        SelectionFailure::DefectBetweenNodes { .. } | SelectionFailure::FeatureAtNodes { .. }
                    );
                    let cause = if nearest.is_finite() && !is_specific { SelectionFailure::Budget } else { cause };
                    return Err(failed(nearest, cause).into());
                }
                TrialEnd::Narrow { part } => {
                    narrow_features += 1;
                    (part, SelectionFailure::Unresolved { t: t0 + part * span })
                }
                TrialEnd::Unresolved { part } => (part, SelectionFailure::Unresolved { t: t0 + part * span }),
                TrialEnd::StepFailed { part, cause: failure } => {
                    (part, SelectionFailure::StepFailed { t: t0 + part * span, cause: failure })
                }
            };
            let (part, failure) = stopped;
            let same = (part - failures.1).abs() <= MAX_DISTANCE_OF_ONE_TIME && k > LONG_SEARCH_STEPS;
            (failures, cause) = ((if same { failures.0 + 1 } else { 1 }, part), failure);
            if trials.tests_uneven_steps && k >= MIN_RATIO_FOR_DIVISION * first {
                return Err(Ended::Switch { reason: SwitchReason::Divided, otherwise: failed(nearest, failure) });
            }
            if failures.0 == MAX_FAILURES_AT_ONE_TIME {
                break 'search;
            }
            k *= 2;
            continue 'search;
        }
        let mut finer = second;
        if finer < k {
            tracks.reverse();
            (k, finer) = (finer, k);
        }
        let [coarse, fine] = tracks.as_slice() else { break };
        let ratio = finer as f64 / k as f64;
        // Runs that agree in all digits may still have an error of half a unit in the last place.
        let error = max_or_nan(coarse.distance(fine), 0.5 * f64::EPSILON);
        // The defect of a smooth motion decreases with order s; at a jump it does not decrease; if only round-off
        // remains it is negligible.
        let falls = fine.defect
            <= max_or_nan(
                coarse.defect / ratio.powf(MIN_DEFECT_ORDER),
                max_or_nan(NEGLIGIBLE_DEFECT * wanted, MIN_COMPARED_DEFECT),
            );
        let fall = (coarse.defect / fine.defect).log2() / ratio.log2();
        let order = if fall.is_nan() { s } else { fall.clamp(0.0, s) };
        // The error of the finer run: it has order 2s, whereas the defect has order s.
        // Errors scatter about that order, by as much as they decrease from one of two runs that are near to the other.
        let asymptotic = smooth && ratio >= MIN_ASYMPTOTIC_RATIO;
        let per_order = if asymptotic { ERROR_ORDER_OF_SMOOTH_MOTIONS } else { ERROR_ORDER_PER_DEFECT_ORDER };
        let distances = coarse.distances(fine);
        // Round-off does not decrease with the step size; along the motion it grows like the distance of the runs. The same
        // holds for what iterations leave.
        let growth = distances.last().copied().unwrap_or(0.0) / distances.first().copied().unwrap_or(0.0);
        let round_off = ROUND_OFF_OF_A_STEP * max_or_nan(growth, 1.0) * (k as f64).sqrt();
        // What the iterations of both runs leave is also a part of their distance.
        let of_iterations = if loose { (trials.of_iterations * max_or_nan(growth, 1.0)).min(error) } else { 0.0 };
        let beyond = error / ratio.powf(per_order * order);
        let allowed = MAX_PREDICTED_ERROR * goal;
        let agreed = error <= MAX_DISTANCE_OF_AGREEING_RUNS * goal
            || (error <= MAX_PREDICTIVE_DISTANCE
                && max_or_nan(round_off, beyond) <= allowed
                && of_iterations <= MAX_OF_ITERATIONS * goal);
        if falls && agreed && trials.samples_few_steps(stages * finer)? && !trials.keeps_energy(fine, &grid, finer) {
            (trials.samples_all_steps, next) = (true, None);
            continue;
        }
        let mut disagreement = None;
        if falls && agreed {
            disagreement = disagreement_of_other_nodes(trials, stages, k, compared, goal, fine)?;
        }
        if falls && agreed && disagreement.is_none() {
            let repeat = |trials: &mut TrialRuns<'_, '_>| trials.gauss_without_samples(stages, k, &grid);
            let last_digit = trials.error_of_last_digit([coarse, fine], repeat)?;
            return Ok(Converged {
                k,
                finer,
                errors: [error, beyond + of_iterations],
                last_digit,
                defect: coarse.defect,
                order,
                finer_is_cheaper: fine.cost < coarse.cost,
                reference: fine.clone(),
                grid,
                irregular: irregular
                    || narrow_features > 0
                    || fall > MAX_DEFECT_ORDER * s
                    || growth_of_distances(&distances) > MAX_REGULAR_GROWTH,
            });
        }
        irregular |= !falls || disagreement.is_some();
        let apart = error;
        let error = max_or_nan(error, disagreement.unwrap_or(0.0));
        stagnations = if error < 0.5 * best { 0 } else { stagnations + 1 };
        let order_of_errors = f64::log2(before / error);
        last = Some((k, coarse.clone(), order_of_errors));
        cause = if !falls && agreed {
            SelectionFailure::DefectBetweenNodes { defect: fine.defect, order }
        } else if !falls {
            SelectionFailure::Order { order }
        } else if let Some(distance) = disagreement {
            SelectionFailure::FeatureAtNodes { distance }
        } else if before.is_nan() {
            // The first two runs do not determine an order, and are the last ones if others would cost too much.
            SelectionFailure::Budget
        } else if fine.has_underflown() {
            SelectionFailure::RoundOff
        } else {
            cause_of_disagreement(&distances, order_of_errors, wanted, t0, span)
        };
        (best, before) = (if error < best { error } else { best }, error);
        nearest = if apart < nearest { apart } else { nearest };
        // The defect of a step over a kink that is not known falls with the step only.
        if trials.tests_uneven_steps && !falls && k >= MIN_RATIO_FOR_DIVISION * first {
            return Err(Ended::Switch { reason: SwitchReason::Divided, otherwise: failed(nearest, cause) });
        }
        // No run is started that the budget would not complete.
        let affordable = trials.left.max(trials.reserve);
        if stagnations == MAX_STAGNATIONS || 2 * (left - trials.reserve) > affordable {
            break;
        }
        known = Some(fine.clone());
        next = Some(if falls { pairs.next(&grid, finer, beyond) } else { 2 * finer });
        k = finer;
    }
    if let Some((k, coarse, order)) = last {
        let repeat = |trials: &mut TrialRuns<'_, '_>| trials.gauss_without_samples(stages, k, &grid);
        cause = trials.tested_cause(cause, (k, &coarse, order), repeat)?;
    }
    Err(failed(nearest, cause).into())
}

/// The distance between the end of a run with k + 1 steps and that of two runs that agree, if it is too large. The
/// nodes of both of these lie on the ends of the k steps, and so on any kink or pulse that begins at one of them.
/// `None` if the third run agrees too, or if no feature can be hidden: kinks of a formula that is proved end steps.
pub(crate) fn disagreement_of_other_nodes(
    trials: &mut TrialRuns<'_, '_>,
    stages: usize,
    k: usize,
    compared: Compared,
    goal: f64,
    fine: &Track,
) -> Result<Option<f64>, InputError> {
    let structure = &trials.request.problem.structure;
    if trials.request.problem.system.hints().proved
        || matches!(compared, Compared::Times)
        || structure.quadratic && structure.autonomous
    {
        return Ok(None);
    }
    Ok(match trials.gauss(stages, k + 1, &ComparisonGrid::of(k + 1), false, false)? {
        TrialEnd::Completed(track) => {
            Some(track.distance_at_end(fine)).filter(|distance| distance.is_nan() || *distance > goal)
        }
        TrialEnd::Exhausted => None,
        _ => Some(f64::INFINITY),
    })
}
