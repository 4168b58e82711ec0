//! The integrator and the number of steps for a wanted error.

mod divided;
pub(crate) mod ended;
mod estimate;
mod first_guess;
pub(crate) mod noise;
mod reference;
pub(crate) mod rest;
mod track;
mod trial_runs;
mod velocities;

pub(crate) use first_guess::first_guess;
use reference::by_reference;

use crate::gauss::MAX_STAGES;
use crate::run::accuracy::divided::divided_steps;
use crate::run::accuracy::track::Track;
use crate::run::accuracy::trial_runs::{ComparisonGrid, SwitchReason, TrialEnd, TrialRuns};
use crate::run::{MOST_STEPS, Request, Shared, Terminal};
use crate::{GaussCollocation, InputError, SelectionFailure, TransformedGauss};
use contact_geom::{Lagrangian, max_or_nan};
use std::sync::Arc;

/// The searches that may follow each other: each makes the steps shorter, or ends.
const ATTEMPTS: usize = 64;

/// The refinements, of so many steps, after which a step that still cannot be taken, or is not resolved, at the same time never will
/// be, and those after which something narrow that is still between the nodes is left to the comparison of runs.
const HALTS: usize = 8;
const LONG: usize = 512;
const NARROWS: usize = 10;

/// The times that equal steps are more than the motion asks for at its start, from which on steps that are divided are tried: each part costs
/// some times as much as a step.
const UNEVEN: usize = 32;

/// The stages of the reference for other methods.
const REFERENCE: usize = 12;

/// The stages from which a Gauss method is its own reference.
const OWN: usize = 6;

/// The stages where there are few steps, or dear ones.
const STAGES: usize = 8;

/// The steps of so many stages, as the motion at its start lets expect, from which on the most stages are the cheapest where
/// the accelerations alone are iterated: half as many evaluations for an error, in the trial runs too, against tables of four times the size.
const MANY: usize = 32;

/// The stages in transformed time, for every error: what its time transformation makes smooth could be followed by longer steps of more stages, were it not for
/// the iteration.
const TRANSFORMED_STAGES: usize = 8;

/// What is chosen for a run.
pub(crate) struct StepSelection<'p, L, const N: usize> {
    pub integrator: Shared<'p, L, N>,
    pub count: usize,
    /// The length of a step; in transformed time, in its time.
    pub h: f64,
    /// The error that the trial runs found, or predict; `None` where the steps are given.
    pub error: Option<f64>,
    /// The steps after which an observer is to end the run, where they go on beyond.
    pub ended: Option<usize>,
}

impl<L, const N: usize> Clone for StepSelection<'_, L, N> {
    fn clone(&self) -> Self {
        StepSelection { integrator: self.integrator.clone(), ..*self }
    }
}

/// A motion that runs with k and 2k steps agree on.
struct Converged<const N: usize> {
    k: usize,
    /// The error of the run with k steps, and what is predicted of that with 2k.
    errors: [f64; 2],
    /// The largest misfit between the nodes of the run with k steps, and the order with which it falls: half of that of the error.
    defect: f64,
    order: f64,
    /// Whether the run with 2k steps costs less: its iterations converge where longer steps need Newton's method.
    finer_is_cheaper: bool,
    truth: Track<N>,
    marks: ComparisonGrid,
    /// Whether something narrow was met on the way, or misfits that did not fall like those of a smooth motion: these steps tell nothing of
    /// others.
    rough: bool,
}

/// The stages of Gauss collocation where no integrator is named: few steps of many stages cost their tables, many steps of few stages their
/// number.
fn stages_along<L: Lagrangian<N>, const N: usize>(request: &Request<'_, L, N>, wanted: f64) -> usize {
    let structure = &request.problem.structure;
    let condensed = structure.separable && structure.has_constant_rate();
    // General steps as long as those of so many stages are not solved by sweeps.
    if condensed && first_guess(request, STAGES, wanted) >= MANY { MAX_STAGES } else { STAGES }
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
        Some(stages) if stages >= OWN && info.in_transformed_time => {
            Ok(in_transformed_time(trials, &integrator, stages)?)
        }
        Some(stages) if stages >= OWN => Ok(by_equal_steps(trials, &integrator, stages)?),
        _ => {
            let at = if info.in_transformed_time { Compared::Times } else { Compared::Tenths };
            let found = converge(trials, REFERENCE, wanted / 8.0, at)?;
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
    trials.watches_transformation = const { L::HAS_TIME_TRANSFORMATION } && trials.request.problem.structure.autonomous;
    trials.watches_newton = stages > STAGES;
    // Parts that end where a kink is hidden would agree on a wrong motion: only where all kinks are known are steps divided.
    let divides = const { L::PROVED || L::HAS_SWITCHING_FUNCTIONS };
    trials.watches_uneven = divides;
    let mut found = by_equal_steps(trials, &gauss(stages), stages);
    trials.watches_newton = false;
    if let Err(Ended::SwitchReason(SwitchReason::FewerStages)) = found {
        stages = STAGES;
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

/// How a search ends that finds no runs that agree.
enum Ended {
    Refused(InputError),
    /// Another integrator is cheaper; trial runs that watch for that end there.
    SwitchReason(SwitchReason),
}

impl From<InputError> for Ended {
    fn from(refused: InputError) -> Self {
        Ended::Refused(refused)
    }
}

impl From<Ended> for InputError {
    fn from(ended: Ended) -> Self {
        // Nothing else ends a search that does not watch for it.
        if let Ended::Refused(refused) = ended { refused } else { InputError::NoIntegrator }
    }
}

/// Where trial runs are compared.
#[derive(Clone, Copy)]
enum Compared {
    /// At the ends of steps next to tenths of the span.
    Steps,
    /// At tenths of the span, which divide the numbers of steps.
    Tenths,
    /// At tenths of the span; the runs are in the motion's transformed time.
    Times,
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

/// The choice of steps of which so many fill the span; in transformed time they are counted anew, in its time.
fn chosen<'p, L: Lagrangian<N>, const N: usize>(
    trials: &TrialRuns<'_, 'p, L, N>,
    integrator: &Shared<'p, L, N>,
    count: usize,
    error: f64,
    found: &Converged<N>,
) -> StepSelection<'p, L, N> {
    let (h, integrator, error) = (trials.step(count, &found.marks), integrator.clone(), Some(error));
    if let ComparisonGrid::Times = found.marks {
        // The last step is about half of the others, so that no rounding adds one.
        let count = (found.truth.tau / h + 0.5).ceil().max(1.0);
        return StepSelection {
            integrator,
            count: count as usize,
            h: found.truth.tau / (count - 0.5),
            error,
            ended: None,
        };
    }
    StepSelection { integrator, count, h, error, ended: None }
}

/// Finds the runs that agree.
fn converge<L: Lagrangian<N>, const N: usize>(
    trials: &mut TrialRuns<'_, '_, L, N>,
    stages: usize,
    goal: f64,
    compared: Compared,
) -> Result<Converged<N>, Ended> {
    let refuse = |wanted, reached, cause| Err(InputError::Accuracy { wanted, reached, cause }.into());
    let (wanted, t0, span) = (trials.wanted, trials.request.problem.t0, trials.request.span);
    let s = stages as f64;
    let marks_of = |k: usize| match compared {
        Compared::Steps => ComparisonGrid::of(k),
        Compared::Tenths => ComparisonGrid::equal(k),
        Compared::Times => ComparisonGrid::Times,
    };
    let mut k = first_guess(trials.request, stages, goal);
    let first = k.max(LONG / UNEVEN);
    let mut marks = marks_of(k);
    let (mut best, mut strikes, mut narrows, mut halts) = (f64::INFINITY, 0, 0, (0, 0.0));
    // The smallest distance of two runs, whatever a third one says; and what keeps them from agreeing.
    let (mut nearest, mut cause) = (f64::INFINITY, SelectionFailure::Budget);
    // The finer of the last two runs, and their distance.
    let (mut known, mut before): (Option<Track<N>>, f64) = (None, f64::NAN);
    let (mut guessed, mut rough) = (false, false);
    'search: for _ in 0..ATTEMPTS {
        if 2.0 * k as f64 > MOST_STEPS {
            break;
        }
        if known.is_none() {
            marks = marks_of(k);
            k = marks.whole(k as f64);
        }
        let left = trials.reserve;
        let mut tracks = Vec::with_capacity(2);
        for (multiple, closely) in [(1, false), (2, true)] {
            if let Some(track) = known.take() {
                tracks.push(track);
                continue;
            }
            let ending = trials.gauss(stages, multiple * k, &marks, closely, narrows < NARROWS)?;
            let stopped = match ending {
                TrialEnd::Followed(track) => {
                    // The error is about the square of the misfit: what is far too large need not be halved again and again.
                    let more = (track.defect.powi(2) / goal).powf(0.5 / s) / 1.4;
                    if multiple == 1 && !guessed && more > 1.2 {
                        guessed = true;
                        k = (k as f64 * more.min(4.0)).ceil() as usize;
                        continue 'search;
                    }
                    tracks.push(track);
                    continue;
                }
                TrialEnd::SwitchReason(elsewhere) => return Err(Ended::SwitchReason(elsewhere)),
                TrialEnd::Interrupted => return Err(InputError::Interrupted.into()),
                TrialEnd::Exhausted => {
                    let told = matches!(cause, SelectionFailure::Misfit { .. } | SelectionFailure::Hidden { .. });
                    return refuse(
                        wanted,
                        nearest,
                        if nearest.is_finite() && !told { SelectionFailure::Budget } else { cause },
                    );
                }
                TrialEnd::Narrow { part } => {
                    narrows += 1;
                    (part, SelectionFailure::Unresolved { t: t0 + part * span })
                }
                TrialEnd::Unresolved { part } => (part, SelectionFailure::Unresolved { t: t0 + part * span }),
                TrialEnd::Halted { part, cause: halt } => {
                    (part, SelectionFailure::Halted { t: t0 + part * span, cause: halt })
                }
            };
            let (part, obstacle) = stopped;
            // What is narrow may need many halvings, what is singular has no end of them.
            let same = (part - halts.1).abs() <= 0.01 && k > LONG;
            (halts, cause) = ((if same { halts.0 + 1 } else { 1 }, part), obstacle);
            if trials.watches_uneven && k >= UNEVEN * first {
                return Err(Ended::SwitchReason(SwitchReason::Divided));
            }
            if halts.0 == HALTS {
                break 'search;
            }
            k *= 2;
            continue 'search;
        }
        let [coarse, fine] = tracks.as_slice() else { break };
        // Runs that agree in all digits may still be off by half of the last one.
        let error = max_or_nan(coarse.distance(fine), 0.5 * f64::EPSILON);
        // A misfit of a smooth motion falls with the order s. What jumps has one that does not; what is rounded has none to speak of.
        let falls = fine.defect <= max_or_nan(coarse.defect / 8.0, max_or_nan(0.01 * wanted, 1e-11));
        let fall = (coarse.defect / fine.defect).log2();
        let order = if fall.is_nan() { s } else { fall.clamp(0.0, s) };
        // What is left of the error in the finer run: it is of the order 2s, where the misfit is of the order s.
        let beyond = error / 2.0f64.powf(1.5 * order);
        let distances = coarse.distances(fine);
        // Round-off does not fall; it grows like the distances of the runs.
        let growth = distances.last().copied().unwrap_or(0.0) / distances.first().copied().unwrap_or(0.0);
        let rounded = 2e-15 * max_or_nan(growth, 1.0) * (k as f64).sqrt();
        let agreed = error <= 0.25 * goal || (error <= 1e-2 && beyond <= 0.1 * goal && rounded <= 0.1 * goal);
        let mut hidden = None;
        if falls && agreed {
            hidden = beside_nodes(trials, stages, k, compared, goal, fine)?;
        }
        if falls && agreed && hidden.is_none() {
            return Ok(Converged {
                k,
                errors: [error, beyond],
                defect: coarse.defect,
                order,
                finer_is_cheaper: fine.cost < coarse.cost,
                truth: fine.clone(),
                marks,
                // More than twice the order is none: the finer steps end at a kink.
                rough: rough || narrows > 0 || fall > 2.0 * s,
            });
        }
        rough |= !falls || hidden.is_some();
        let apart = error;
        let error = max_or_nan(error, hidden.unwrap_or(0.0));
        strikes = if error < 0.5 * best { 0 } else { strikes + 1 };
        cause = if !falls && agreed {
            SelectionFailure::Misfit { defect: fine.defect, order }
        } else if !falls {
            SelectionFailure::Order { order }
        } else if let Some(distance) = hidden {
            SelectionFailure::Hidden { distance }
        } else if before.is_nan() {
            // The first two runs show no order, and are the last if others would cost too much.
            SelectionFailure::Budget
        } else if fine.has_underflown() {
            SelectionFailure::RoundOff
        } else {
            obstacle(&distances, (before / error).log2(), wanted, t0, span)
        };
        (best, before) = (if error < best { error } else { best }, error);
        nearest = if apart < nearest { apart } else { nearest };
        // Not begun, if it cannot end.
        let affordable = trials.left.max(trials.reserve);
        if strikes == 3 || 2 * (left - trials.reserve) > affordable {
            break;
        }
        known = Some(fine.clone());
        k *= 2;
    }
    refuse(wanted, nearest, cause)
}

/// How far the end of a run with one step more is from that of two runs that agree, where that is too far: nodes of both lie on the ends of the k
/// steps, and so on whatever kink or pulse begins at one of them. `None` where they agree too, or where nothing can hide: kinks of a formula that is
/// proved end steps.
fn beside_nodes<L: Lagrangian<N>, const N: usize>(
    trials: &mut TrialRuns<'_, '_, L, N>,
    stages: usize,
    k: usize,
    compared: Compared,
    goal: f64,
    fine: &Track<N>,
) -> Result<Option<f64>, InputError> {
    let structure = &trials.request.problem.structure;
    if const { L::PROVED } || matches!(compared, Compared::Times) || structure.quadratic && structure.autonomous {
        return Ok(None);
    }
    Ok(match trials.gauss(stages, k + 1, &ComparisonGrid::of(k + 1), false, false)? {
        TrialEnd::Followed(track) => {
            Some(track.distance_at_end(fine)).filter(|distance| distance.is_nan() || *distance > goal)
        }
        TrialEnd::Exhausted => None,
        _ => Some(f64::INFINITY),
    })
}

/// What keeps runs from agreeing, by their distances along the motion and the order that they show.
pub(crate) fn obstacle(distances: &[f64], order: f64, wanted: f64, t0: f64, span: f64) -> SelectionFailure {
    let (first, last) = (distances.first().copied().unwrap_or(0.0), distances.last().copied().unwrap_or(0.0));
    // The order that is left where runs differ by nothing but what they have rounded.
    let noise = order < 2.0;
    if noise && last > 1e-8 && last > 1e4 * first {
        let kept = distances.iter().take_while(|d| **d <= wanted).count();
        return SelectionFailure::Chaos { t: t0 + span * kept as f64 / distances.len() as f64 };
    }
    // Where only roundings are left they may show any order.
    if noise && last < 1e-9 || last <= 64.0 * f64::EPSILON {
        SelectionFailure::RoundOff
    } else {
        SelectionFailure::Order { order }
    }
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

#[cfg(test)]
mod tests;
