//! The reference: runs with k and 2k steps of contact Gauss collocation that agree.

use crate::run::accuracy::failure::obstacle;
use crate::run::accuracy::first_guess::first_guess;
use crate::run::accuracy::track::Track;
use crate::run::accuracy::trial_runs::{ComparisonGrid, SwitchReason, TrialEnd, TrialRuns};
use crate::run::request::{MOST_STEPS, Shared, StepSelection};
use crate::{InputError, SelectionFailure};
use contact_geom::{Lagrangian, numbers::max_or_nan};

/// The searches that may follow each other: each makes the steps shorter, or ends.
pub(crate) const MAX_SEARCHES: usize = 64;

/// The refinements, of so many steps, after which a step that still cannot be taken, or is not resolved, at the same time never will
/// be, and those after which something narrow that is still between the nodes is left to the comparison of runs.
const MAX_FAILURES_AT_ONE_TIME: usize = 8;
const LONG_SEARCH_STEPS: usize = 512;
const MAX_NARROW_RUNS: usize = 10;

/// The times that equal steps are more than the motion asks for at its start, from which on steps that are divided are tried: each part costs
/// some times as much as a step.
const UNEVEN: usize = 32;

/// A motion that runs with k and 2k steps agree on.
pub(crate) struct Converged<const N: usize> {
    pub k: usize,
    /// The error of the run with k steps, and what is predicted of that with 2k.
    pub errors: [f64; 2],
    /// The largest misfit between the nodes of the run with k steps, and the order with which it falls: half of that of the error.
    pub defect: f64,
    pub order: f64,
    /// Whether the run with 2k steps costs less: its iterations converge where longer steps need Newton's method.
    pub finer_is_cheaper: bool,
    pub truth: Track<N>,
    pub marks: ComparisonGrid,
    /// Whether something narrow was met on the way, or misfits that did not fall like those of a smooth motion: these steps tell nothing of
    /// others.
    pub rough: bool,
}

/// How a search ends that finds no runs that agree.
pub(crate) enum Ended {
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
pub(crate) enum Compared {
    /// At the ends of steps next to tenths of the span.
    Steps,
    /// At tenths of the span, which divide the numbers of steps.
    Tenths,
    /// At tenths of the span; the runs are in the motion's transformed time.
    Times,
}

/// The choice of steps of which so many fill the span; in transformed time they are counted anew, in its time.
pub(crate) fn chosen<'p, L: Lagrangian<N>, const N: usize>(
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
    // The smallest distance of two runs, whatever a third one says; and what keeps them from agreeing.
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
