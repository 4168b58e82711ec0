//! The selection of the integrator and of the number of steps for a requested error.

use crate::gauss::MAX_STAGES;
use crate::run::accuracy::converge::{Compared, Converged, Ended, chosen, converge};
use crate::run::accuracy::divided::divided_steps;
use crate::run::accuracy::first_guess::first_guess;
use crate::run::accuracy::reference::{REFERENCE_STAGES, by_reference};
use crate::run::accuracy::trial_runs::{SwitchReason, TrialRuns};
use crate::run::observers::observer::Terminal;
use crate::run::request::{Request, Shared, StepSelection};
use crate::{GaussCollocation, InputError, SelectionFailure, TransformedGauss};
use contact_geom::{Lagrangian, numbers::max_or_nan};
use std::sync::Arc;

/// The stages from which a Gauss method is its own reference.
const OWN_REFERENCE_STAGES: usize = 6;

/// The stages where there are few steps, or dear ones.
const DEFAULT_STAGES: usize = 8;

/// The steps of so many stages, as the motion at its start lets expect, from which on the most stages are the cheapest where
/// the accelerations alone are iterated: half as many evaluations for an error, in the trial runs too, against tables of four times the size.
const MANY_STEPS: usize = 32;

/// The stages in transformed time, for every error: what its time transformation makes smooth could be followed by longer steps of more stages, were it not for
/// the iteration.
const TRANSFORMED_STAGES: usize = 8;

/// The stages of Gauss collocation where no integrator is named: few steps of many stages cost their tables, many steps of few stages their
/// number.
fn stages_along<L: Lagrangian<N>, const N: usize>(request: &Request<'_, L, N>, wanted: f64) -> usize {
    let structure = &request.problem.structure;
    let condensed = structure.separable && structure.has_constant_rate();
    // General steps as long as those of so many stages are not solved by sweeps.
    if condensed && first_guess(request, DEFAULT_STAGES, wanted) >= MANY_STEPS { MAX_STAGES } else { DEFAULT_STAGES }
}

/// Chooses the steps, and the integrator where the run names none, so that the error of (q, p) relative to their size, and of v, is at most
/// `wanted` at ten times along the motion.
///
/// By the time transformation that the motion states, where steps that are equal in its time are much fewer: the first run with equal steps sees
/// that, and ends there.
///
/// A reference is found first: contact Gauss collocation with k and 2k steps. They must agree; and between the nodes their curves must
/// solve Herglotz' equations up to a misfit that falls from the one to the other as it does where the motion is smooth. The search ends
/// a run at the first step that does not resolve the motion, so that runs that are far too coarse cost nothing. The error of the
/// integrator's own runs is then their distance from the reference.
///
/// Where `terminal` ends the run, all these end there.
pub(crate) fn choose<'p, L: Lagrangian<N>, const N: usize>(
    request: &Request<'p, L, N>,
    wanted: f64,
    terminal: Option<Terminal<'_, N>>,
) -> Result<StepSelection<'p, L, N>, InputError> {
    if !(wanted > 0.0 && wanted.is_finite()) {
        return Err(InputError::Tolerance { wanted });
    }
    let choose = |request: &Request<'p, L, N>| {
        choose_with(&mut TrialRuns::new(request, wanted)).map_err(|refused| request.by_rounding_of_velocity(refused))
    };
    let Some(t_end) = terminal.and_then(|terminal| request.time_of_end(terminal)) else {
        return choose(request);
    };
    // What lies beyond the end is not followed.
    let span = t_end - request.problem.t0;
    let part = Request { t_end, span, integrator: request.integrator.clone(), ..*request };
    Ok(choose(&part)?.going_on(request.span / span))
}

/// The same with a budget.
pub(crate) fn choose_with<'p, L: Lagrangian<N>, const N: usize>(
    trials: &mut TrialRuns<'_, 'p, L, N>,
) -> Result<StepSelection<'p, L, N>, InputError> {
    let wanted = trials.wanted;
    let Some(integrator) = trials.request.integrator.clone() else { return choose_all(trials) };
    let info = integrator.info();
    match info.collocation {
        Some(stages) if stages >= OWN_REFERENCE_STAGES && info.in_transformed_time => {
            Ok(in_transformed_time(trials, &integrator, stages)?)
        }
        Some(stages) if stages >= OWN_REFERENCE_STAGES => Ok(by_equal_steps(trials, &integrator, stages)?),
        _ => {
            let at = if info.in_transformed_time { Compared::Times } else { Compared::Tenths };
            let found = converge(trials, REFERENCE_STAGES, wanted / 8.0, at)?;
            by_reference(trials, &integrator, &found)
        }
    }
}

/// The same where no integrator is named.
fn choose_all<'p, L: Lagrangian<N>, const N: usize>(
    trials: &mut TrialRuns<'_, 'p, L, N>,
) -> Result<StepSelection<'p, L, N>, InputError> {
    let gauss = |stages: usize| -> Shared<'p, L, N> { Arc::new(GaussCollocation { stages }) };
    let mut stages = stages_along(trials.request, trials.wanted);
    trials.watches_transformation =
        const { L::HINTS.time_transformation } && trials.request.problem.structure.autonomous;
    trials.watches_newton = stages > DEFAULT_STAGES;
    // Parts that end where a kink is hidden would agree on a wrong motion: only where all kinks are known are steps divided.
    let divides = const { L::HINTS.proved || L::HINTS.switching_functions };
    trials.watches_uneven = divides;
    let mut found = by_equal_steps(trials, &gauss(stages), stages);
    trials.watches_newton = false;
    if let Err(Ended::SwitchReason(SwitchReason::FewerStages)) = found {
        stages = DEFAULT_STAGES;
        found = by_equal_steps(trials, &gauss(stages), stages);
    }
    (trials.watches_transformation, trials.watches_uneven) = (false, false);
    if let Err(Ended::SwitchReason(SwitchReason::Divided)) = found {
        match divided_steps(trials) {
            Ok(choice) => return Ok(choice),
            Err(interrupted @ InputError::Interrupted) => return Err(interrupted),
            Err(_) => found = by_equal_steps(trials, &gauss(stages), stages),
        }
    }
    // Where a part of the motion asks for much shorter steps than the rest, those are divided; and they are refused for the first reason.
    if let Err(Ended::Refused(refused @ InputError::Accuracy { cause, .. })) = &found
        && divides
        && !matches!(cause, SelectionFailure::RoundOff | SelectionFailure::Chaos { .. })
    {
        return divided_steps(trials).map_err(|divided| match divided {
            InputError::Accuracy { reached, .. } if reached.is_finite() => divided,
            InputError::Interrupted => divided,
            _ => *refused,
        });
    }
    let Err(Ended::SwitchReason(SwitchReason::TimeTransformation)) = found else { return Ok(found?) };
    // Where the time transformation leads nowhere equal steps may.
    let transformed: Shared<'p, L, N> = Arc::new(TransformedGauss { stages: TRANSFORMED_STAGES });
    Ok(in_transformed_time(trials, &transformed, TRANSFORMED_STAGES).or_else(|ended| match ended {
        Ended::Refused(InputError::Interrupted) => Err(ended),
        _ => by_equal_steps(trials, &gauss(stages), stages),
    })?)
}

/// Gauss collocation that is its own reference, with equal steps.
fn by_equal_steps<'p, L: Lagrangian<N>, const N: usize>(
    trials: &mut TrialRuns<'_, 'p, L, N>,
    integrator: &Shared<'p, L, N>,
    stages: usize,
) -> Result<StepSelection<'p, L, N>, Ended> {
    let wanted = trials.wanted;
    let found = converge(trials, stages, wanted, Compared::Steps)?;
    // Where W or the drag changes along the motion a longer step may leave their domain, as no misfit foretells.
    let structure = &trials.request.problem.structure;
    let longer = structure.separable && structure.has_constant_rate();
    let (count, error) = fewest(stages, wanted, &found, longer);
    Ok(chosen(trials, integrator, count, error, &found))
}

/// The same with steps that are equal in the time of the motion's transformed time.
fn in_transformed_time<'p, L: Lagrangian<N>, const N: usize>(
    trials: &mut TrialRuns<'_, 'p, L, N>,
    integrator: &Shared<'p, L, N>,
    stages: usize,
) -> Result<StepSelection<'p, L, N>, Ended> {
    let wanted = trials.wanted;
    let found = converge(trials, stages, wanted, Compared::Times)?;
    let (count, error) = fewest(stages, wanted, &found, false);
    Ok(chosen(trials, integrator, count, error, &found))
}

/// The fewest steps of a Gauss method that the converged runs allow, with the error that they predict.
fn fewest<const N: usize>(stages: usize, wanted: f64, found: &Converged<N>, longer: bool) -> (usize, f64) {
    let Converged { k, errors: [error, beyond], defect, order, finer_is_cheaper, rough, .. } = *found;
    // Ten times as exactly as wanted between the runs and beyond them, as errors of neighbouring steps may differ so much.
    let (target, predicted) = (0.2 * wanted, 0.02 * wanted);
    let steps = |order: f64| (k as f64 * (max_or_nan(error, 1e-14) / predicted).powf(1.0 / order)).ceil();
    // Steps that end at a kink by chance agree, and others do not.
    if rough || order < stages as f64 / 3.0 {
        return if error <= target { (k, error) } else { (2 * k, beyond) };
    }
    if finer_is_cheaper {
        return (2 * k, beyond);
    }
    if error <= target {
        // The error of longer steps grows faster than their order. They are taken only where the misfit says that they still resolve the
        // motion.
        let fewer = steps(2.5 * stages as f64).max((0.6 * k as f64).ceil());
        let coarser = defect * (k as f64 / fewer).powf(stages as f64);
        return if longer && fewer < k as f64 && coarser <= 1e-2 { (fewer as usize, predicted) } else { (k, error) };
    }
    // That of shorter steps falls like the square of the misfit.
    let more = steps(2.0 * order);
    if more < 2.0 * k as f64 { (more as usize, max_or_nan(predicted, beyond)) } else { (2 * k, beyond) }
}
