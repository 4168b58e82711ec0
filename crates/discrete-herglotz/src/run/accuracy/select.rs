//! The selection of the integrator and of the number of steps for a requested error.

use crate::gauss::MAX_STAGES;
use crate::integration::SharedIntegrator;
use crate::run::accuracy::by_doubled_steps::by_doubled_steps;
use crate::run::accuracy::converge::{Compared, Converged, Ended, converge, selected};
use crate::run::accuracy::divided::divided_steps;
use crate::run::accuracy::first_guess::first_guess;
use crate::run::accuracy::limits::{
    DEFAULT_STAGES, ERROR_ORDER_OF_LONGER_STEPS, MAX_DEFECT_OF_LONGER_STEPS, MAX_STAGES_PER_ORDER,
    MIN_OWN_REFERENCE_STAGES, MIN_PREDICTIVE_ERROR, MIN_STEP_FRACTION, MIN_STEPS_FOR_MAX_STAGES, PREDICTED_ERROR,
    REFERENCE_ERROR, REFERENCE_STAGES, SMALL_ERROR, STAGES_OF_SMALL_ERRORS, TARGET_ERROR, TRANSFORMED_STAGES,
};
use crate::run::accuracy::reference::by_reference;
use crate::run::accuracy::trial_end::SwitchReason;
use crate::run::accuracy::trial_runs::TrialRuns;
use crate::run::observers::observer::Terminal;
use crate::run::request::{Request, StepSelection};
use crate::switching::Collocation;
use crate::{InputError, SelectionFailure};
use contact_geom::numbers::max_or_nan;

/// The number of stages of Gauss collocation if no integrator is given: for few steps the tables of many stages are
/// expensive, for many steps of few stages the number of steps.
fn stages_along(request: &Request<'_>, wanted: f64) -> usize {
    // In general steps the fixed-point iteration does not converge for the step sizes of the largest number of stages.
    if !request.iterates_accelerations() {
        return DEFAULT_STAGES;
    }
    match first_guess(request, DEFAULT_STAGES, wanted) {
        steps if steps >= MIN_STEPS_FOR_MAX_STAGES => MAX_STAGES,
        steps if steps > 1 && wanted <= SMALL_ERROR => STAGES_OF_SMALL_ERRORS,
        _ => DEFAULT_STAGES,
    }
}

/// Selects the steps, and the integrator if the run gives none, so that the error of (q, p) relative to its size, and
/// that of v, is at most `wanted` at ten times along the motion.
///
/// The time transformation of the Lagrangian is used if far fewer steps of equal size in transformed time are
/// sufficient: the first run with equal steps tests this, and ends in this case.
///
/// First a reference solution is computed by contact Gauss collocation with k and 2k steps. The two runs must agree,
/// and between the nodes their curves must satisfy Herglotz' equations up to a defect that decreases from the first run
/// to the second as for a smooth motion. A run ends at its first unresolved step, so that runs that are far too coarse
/// cost little. The error of a run of the integrator is then its distance from the reference.
///
/// If `terminal` ends the run, all these runs end there.
pub(crate) fn select_steps<'p>(
    request: &Request<'p>,
    wanted: f64,
    collocation: Collocation<'p>,
    terminal: Option<Terminal<'_>>,
) -> Result<StepSelection<'p>, InputError> {
    if !(wanted > 0.0 && wanted.is_finite()) {
        return Err(InputError::Tolerance { wanted });
    }
    let select = |request: &Request<'p>| {
        select_within_budget(&mut TrialRuns::new(request, wanted, collocation.clone()))
            .map_err(|refused| request.by_rounding_of_velocity(refused))
    };
    let Some(t_end) = terminal.and_then(|terminal| request.time_of_end(&collocation, terminal)) else {
        return select(request);
    };
    // The motion after this end is not computed.
    let span = t_end - request.problem.t0;
    let part = Request { t_end, span, ..request.clone() };
    Ok(select(&part)?.extended_by(request.span / span))
}

/// Selects equal steps of the given integrator, for motions that take them together. The search ends with an error where
/// that of a single run would turn to divided steps: equal ones would be many times more.
pub(crate) fn select_equal_steps<'p>(
    request: &Request<'p>,
    wanted: f64,
    collocation: Collocation<'p>,
    _terminal: Option<Terminal<'_>>,
) -> Result<StepSelection<'p>, InputError> {
    if !(wanted > 0.0 && wanted.is_finite()) {
        return Err(InputError::Tolerance { wanted });
    }
    let mut trials = TrialRuns::new(request, wanted, collocation);
    trials.tests_uneven_steps = may_divide(request);
    select_within_budget(&mut trials).map_err(|refused| request.by_rounding_of_velocity(refused))
}

/// Whether steps may be divided. Divided steps that end at an unknown kink could agree on a wrong motion, so all kinks
/// must be known. Those of a Hamiltonian have no derivatives.
fn may_divide(request: &Request<'_>) -> bool {
    let hints = request.problem.system.hints();
    (hints.proved || hints.switching_functions) && !(request.needs.derivatives && hints.hamiltonian)
}

/// The selection with a given budget.
pub(crate) fn select_within_budget<'p>(trials: &mut TrialRuns<'_, 'p>) -> Result<StepSelection<'p>, InputError> {
    let wanted = trials.wanted;
    let Some(integrator) = trials.request.integrator.clone() else { return select_integrator(trials) };
    let info = integrator.info();
    match info.collocation {
        _ if info.constrained => by_doubled_steps(trials, &integrator),
        Some(stages) if stages >= MIN_OWN_REFERENCE_STAGES && info.in_transformed_time => {
            Ok(in_transformed_time(trials, &integrator, stages)?)
        }
        Some(stages) if stages >= MIN_OWN_REFERENCE_STAGES => Ok(by_equal_steps(trials, &integrator, stages)?),
        _ => {
            let at = if info.in_transformed_time { Compared::Times } else { Compared::Tenths };
            let found = converge(trials, REFERENCE_STAGES, REFERENCE_ERROR * wanted, at)?;
            by_reference(trials, &integrator, &found)
        }
    }
}

/// The selection if no integrator is given.
fn select_integrator<'p>(trials: &mut TrialRuns<'_, 'p>) -> Result<StepSelection<'p>, InputError> {
    let collocation = trials.collocation.clone();
    let divides = may_divide(trials.request);
    let mut stages = stages_along(trials.request, trials.wanted);
    // Steps in transformed time have no derivatives.
    let transforms = trials.request.problem.system.hints().time_transformation && !trials.request.needs.derivatives;
    trials.tests_transformation = transforms && trials.request.problem.structure.autonomous;
    trials.tests_newton_steps = stages > DEFAULT_STAGES;
    trials.tests_uneven_steps = divides;
    let mut found = by_equal_steps(trials, &collocation.gauss(stages), stages);
    trials.tests_newton_steps = false;
    if let Err(Ended::Switch { reason: SwitchReason::FewerStages, .. }) = found {
        stages = DEFAULT_STAGES;
        found = by_equal_steps(trials, &collocation.gauss(stages), stages);
    }
    (trials.tests_transformation, trials.tests_uneven_steps) = (false, false);
    if divides && let Err(Ended::Switch { reason: SwitchReason::Divided, .. }) = found {
        match divided_steps(trials) {
            Ok(selection) => return Ok(selection),
            Err(interrupted @ InputError::Interrupted) => return Err(interrupted),
            Err(_) => found = by_equal_steps(trials, &collocation.gauss(stages), stages),
        }
    }
    // If a part of the motion requires much shorter steps than the rest, the steps are divided; if this fails too, the
    // first error is returned.
    if divides
        && let Err(Ended::Refused(refused @ InputError::Accuracy { cause, .. })) = &found
        && !matches!(
            cause,
            SelectionFailure::RoundOff | SelectionFailure::Chaos { .. } | SelectionFailure::IllConditioned { .. }
        )
    {
        return divided_steps(trials).map_err(|divided| match divided {
            InputError::Accuracy { reached, .. } if reached.is_finite() => divided,
            InputError::Interrupted => divided,
            _ => *refused,
        });
    }
    if !transforms {
        return Ok(found?);
    }
    let Err(Ended::Switch { reason: SwitchReason::TimeTransformation, .. }) = found else { return Ok(found?) };
    // If the search in transformed time fails, equal steps are tried.
    let transformed = collocation.transformed_gauss(TRANSFORMED_STAGES);
    Ok(in_transformed_time(trials, &transformed, TRANSFORMED_STAGES).or_else(|ended| match ended {
        Ended::Refused(InputError::Interrupted) => Err(ended),
        _ => by_equal_steps(trials, &collocation.gauss(stages), stages),
    })?)
}

/// The selection for Gauss collocation as its own reference, with equal steps.
fn by_equal_steps<'p>(
    trials: &mut TrialRuns<'_, 'p>,
    integrator: &SharedIntegrator<'p>,
    stages: usize,
) -> Result<StepSelection<'p>, Ended> {
    let wanted = trials.wanted;
    let found = converge(trials, stages, wanted, Compared::Steps)?;
    // If the mass matrix or the drag varies along the motion, a longer step may leave the domain of L, which the defect
    // does not predict.
    let longer = trials.request.iterates_accelerations();
    let (count, error) = min_step_count(stages, wanted, &found, longer);
    let end = trials.take_completed(stages, count);
    Ok(StepSelection { end, tolerance: trials.tolerance(count), ..selected(trials, integrator, count, error, &found) })
}

/// The same selection with steps of equal size in the transformed time of the Lagrangian.
fn in_transformed_time<'p>(
    trials: &mut TrialRuns<'_, 'p>,
    integrator: &SharedIntegrator<'p>,
    stages: usize,
) -> Result<StepSelection<'p>, Ended> {
    let wanted = trials.wanted;
    let found = converge(trials, stages, wanted, Compared::Times)?;
    let (count, error) = min_step_count(stages, wanted, &found, false);
    Ok(selected(trials, integrator, count, error, &found))
}

/// The smallest number of steps of a Gauss method that the converged runs allow, with the error that they predict; that of
/// one of these runs, if they differ by little.
fn min_step_count(stages: usize, wanted: f64, found: &Converged, longer: bool) -> (usize, f64) {
    let Converged { k, finer, errors: [error, beyond], defect, order, finer_is_cheaper, irregular, .. } = *found;
    let (target, predicted) = (TARGET_ERROR * wanted, PREDICTED_ERROR * wanted);
    let steps =
        |order: f64| (k as f64 * (max_or_nan(error, MIN_PREDICTIVE_ERROR) / predicted).powf(1.0 / order)).ceil();
    // Steps that end at a kink by chance agree, while other steps do not. Runs that differ by little leave nothing to gain,
    // and one of them may be the run itself; it is taken whatever is observed, which does not change a motion.
    let close = finer < 2 * k;
    if close || irregular || order < stages as f64 / MAX_STAGES_PER_ORDER {
        return if error <= target { (k, error) } else { (finer, beyond) };
    }
    if finer_is_cheaper {
        return (finer, beyond);
    }
    if error <= target {
        // Longer steps are taken only if the predicted defect shows that they still resolve the motion.
        let fewer = steps(ERROR_ORDER_OF_LONGER_STEPS * stages as f64).max((MIN_STEP_FRACTION * k as f64).ceil());
        let coarser = defect * (k as f64 / fewer).powf(stages as f64);
        return if longer && fewer < k as f64 && coarser <= MAX_DEFECT_OF_LONGER_STEPS {
            (fewer as usize, predicted)
        } else {
            (k, error)
        };
    }
    // The error of shorter steps decreases like the square of the defect.
    let more = steps(2.0 * order);
    if more < finer as f64 { (more as usize, max_or_nan(predicted, beyond)) } else { (finer, beyond) }
}
