//! The reference solution: runs with k and 2k steps of contact Gauss collocation that agree.

use crate::run::accuracy::failure::obstacle;
use crate::run::accuracy::first_guess::first_guess;
use crate::run::accuracy::track::Track;
use crate::run::accuracy::trial_runs::{ComparisonGrid, SwitchReason, TrialEnd, TrialRuns};
use crate::run::request::{MOST_STEPS, Shared, StepSelection};
use crate::{InputError, SelectionFailure};
use contact_geom::{Lagrangian, numbers::max_or_nan};

/// The largest number of iterations of a search: each refines the steps or ends the search.
pub(crate) const MAX_SEARCHES: usize = 64;

/// The number of refinements, of runs with more than [`LONG_SEARCH_STEPS`] steps, after which a step that still fails
/// or is unresolved at the same time ends the search; and the number of refinements after which a narrow feature
/// between the nodes is left to the comparison of runs.
const MAX_FAILURES_AT_ONE_TIME: usize = 8;
const LONG_SEARCH_STEPS: usize = 512;
const MAX_NARROW_RUNS: usize = 10;

/// The ratio of the number of equal steps to the number that the motion requires at its start, from which on divided
/// steps are tried: each part costs several times as much as a step.
const UNEVEN: usize = 32;

/// A motion on which runs with k and 2k steps agree.
pub(crate) struct Converged<const N: usize> {
    pub k: usize,
    /// The error of the run with k steps, and the predicted error of the run with 2k steps.
    pub errors: [f64; 2],
    /// The largest defect between the nodes of the run with k steps, and the order with which it decreases, half the
    /// order of the error.
    pub defect: f64,
    pub order: f64,
    /// Whether the run with 2k steps costs less: its fixed-point iterations converge, where longer steps need Newton's
    /// method.
    pub finer_is_cheaper: bool,
    pub truth: Track<N>,
    pub marks: ComparisonGrid,
    /// Whether the search found a narrow feature, or defects that do not decrease like those of a smooth motion: the
    /// errors of other numbers of steps cannot be predicted.
    pub rough: bool,
}

/// The end of a search without two runs that agree.
pub(crate) enum Ended {
    Refused(InputError),
    /// Another integrator is less expensive; only searches that test this end here.
    SwitchReason(SwitchReason),
}

impl From<InputError> for Ended {
    fn from(refused: InputError) -> Self {
        Ended::Refused(refused)
    }
}

impl From<Ended> for InputError {
    fn from(ended: Ended) -> Self {
        // The other variant occurs only in searches that test for it.
        if let Ended::Refused(refused) = ended { refused } else { InputError::NoIntegrator }
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
pub(crate) fn chosen<'p, L: Lagrangian<N>, const N: usize>(
    trials: &TrialRuns<'_, 'p, L, N>,
    integrator: &Shared<'p, L, N>,
    count: usize,
    error: f64,
    found: &Converged<N>,
) -> StepSelection<'p, L, N> {
    let (h, integrator, error) = (trials.step(count, &found.marks), integrator.clone(), Some(error));
    if let ComparisonGrid::Times = found.marks {
        // The last step is about half as long as the others, so that round-off does not add a step.
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

/// Refines the steps until two runs agree.
pub(crate) fn converge<L: Lagrangian<N>, const N: usize>(
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
    let first = k.max(LONG_SEARCH_STEPS / UNEVEN);
    let mut marks = marks_of(k);
    let (mut best, mut strikes, mut narrows, mut halts) = (f64::INFINITY, 0, 0, (0, 0.0));
    // The smallest distance of two runs, regardless of a third one; and the reason why they do not agree.
    let (mut nearest, mut cause) = (f64::INFINITY, SelectionFailure::Budget);
    // The finer of the last two runs, and their distance.
    let (mut known, mut before): (Option<Track<N>>, f64) = (None, f64::NAN);
    let (mut guessed, mut rough) = (false, false);
    'search: for _ in 0..MAX_SEARCHES {
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
            let ending = trials.gauss(stages, multiple * k, &marks, closely, narrows < MAX_NARROW_RUNS)?;
            let stopped = match ending {
                TrialEnd::Followed(track) => {
                    // The error is about the square of the defect: from a defect that is far too large the number of
                    // steps is predicted, instead of doubled repeatedly.
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
            // A narrow feature may need many halvings of the step; at a singularity they never suffice.
            let same = (part - halts.1).abs() <= 0.01 && k > LONG_SEARCH_STEPS;
            (halts, cause) = ((if same { halts.0 + 1 } else { 1 }, part), obstacle);
            if trials.watches_uneven && k >= UNEVEN * first {
                return Err(Ended::SwitchReason(SwitchReason::Divided));
            }
            if halts.0 == MAX_FAILURES_AT_ONE_TIME {
                break 'search;
            }
            k *= 2;
            continue 'search;
        }
        let [coarse, fine] = tracks.as_slice() else { break };
        // Runs that agree in all digits may still have an error of half a unit in the last place.
        let error = max_or_nan(coarse.distance(fine), 0.5 * f64::EPSILON);
        // The defect of a smooth motion decreases with order s; at a jump it does not decrease; if only round-off
        // remains it is negligible.
        let falls = fine.defect <= max_or_nan(coarse.defect / 8.0, max_or_nan(0.01 * wanted, 1e-11));
        let fall = (coarse.defect / fine.defect).log2();
        let order = if fall.is_nan() { s } else { fall.clamp(0.0, s) };
        // The error of the finer run: it has order 2s, whereas the defect has order s.
        let beyond = error / 2.0f64.powf(1.5 * order);
        let distances = coarse.distances(fine);
        // Round-off does not decrease with the step size; along the motion it grows like the distance of the runs.
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
                // A decrease of more than twice the order is not due to the order: the finer steps end at a kink.
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
            // The first two runs do not determine an order, and are the last ones if others would cost too much.
            SelectionFailure::Budget
        } else if fine.has_underflown() {
            SelectionFailure::RoundOff
        } else {
            obstacle(&distances, (before / error).log2(), wanted, t0, span)
        };
        (best, before) = (if error < best { error } else { best }, error);
        nearest = if apart < nearest { apart } else { nearest };
        // No run is started that the budget would not complete.
        let affordable = trials.left.max(trials.reserve);
        if strikes == 3 || 2 * (left - trials.reserve) > affordable {
            break;
        }
        known = Some(fine.clone());
        k *= 2;
    }
    refuse(wanted, nearest, cause)
}

/// The distance between the end of a run with k + 1 steps and that of two runs that agree, if it is too large. The
/// nodes of both of these lie on the ends of the k steps, and so on any kink or pulse that begins at one of them.
/// `None` if the third run agrees too, or if nothing can be hidden: kinks of a formula that is proved end steps.
pub(crate) fn beside_nodes<L: Lagrangian<N>, const N: usize>(
    trials: &mut TrialRuns<'_, '_, L, N>,
    stages: usize,
    k: usize,
    compared: Compared,
    goal: f64,
    fine: &Track<N>,
) -> Result<Option<f64>, InputError> {
    let structure = &trials.request.problem.structure;
    if const { L::HINTS.proved } || matches!(compared, Compared::Times) || structure.quadratic && structure.autonomous {
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
