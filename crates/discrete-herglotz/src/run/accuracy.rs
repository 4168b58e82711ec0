//! The integrator and the number of steps for a wanted error.

mod first_guess;
mod reference;

pub(in crate::run) use first_guess::first_guess;
use reference::by_reference;

use super::divided::divided_steps;
use super::pilot::{Elsewhere, Marks, PilotEnd, Pilots};
use super::track::Track;
use super::{MOST_STEPS, Request, Shared, Terminal};
use crate::gauss::MOST;
use crate::{ClockedGauss, GaussCollocation, InputError, Obstacle};
use contact_geom::{Lagrangian, larger};
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
/// the accelerations alone are iterated: half as many evaluations for an error, in the pilot runs too, against tables of four times the size.
const MANY: usize = 32;

/// The stages by a clock, for every error: what its clock makes smooth could be followed by longer steps of more stages, were it not for
/// the iteration.
const BY_CLOCK: usize = 8;

/// What is chosen for a run.
pub(super) struct Choice<'p, L, const N: usize> {
    pub integrator: Shared<'p, L, N>,
    pub count: usize,
    /// The length of a step; by a clock, in its time.
    pub h: f64,
    /// The error that the pilot runs found, or predict; `None` where the steps are given.
    pub error: Option<f64>,
    /// The steps after which an observer is to end the run, where they go on beyond.
    pub ended: Option<usize>,
}

impl<L, const N: usize> Clone for Choice<'_, L, N> {
    fn clone(&self) -> Self {
        Choice { integrator: self.integrator.clone(), ..*self }
    }
}

/// A motion that runs with k and 2k steps agree on.
struct Converged<const N: usize> {
    k: usize,
    /// The error of the run with k steps, and what is predicted of that with 2k.
    errors: [f64; 2],
    /// The largest misfit between the nodes of the run with k steps, and the order with which it falls: half of that of the error.
    misfit: f64,
    order: f64,
    /// Whether the run with 2k steps costs less: its iterations converge where longer steps need Newton's method.
    finer_is_cheaper: bool,
    truth: Track<N>,
    marks: Marks,
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
    if condensed && first_guess(request, STAGES, wanted) >= MANY { MOST } else { STAGES }
}

/// Chooses the steps, and the integrator where the run names none, so that the error of (q, p) relative to their size, and of v, is at most
/// `wanted` at ten times along the motion.
///
/// By the clock that the motion states, where steps that are equal in its time are much fewer: the first run with equal steps sees
/// that, and ends there.
///
/// A reference is found first: contact Gauss collocation with k and 2k steps. They must agree; and between the nodes their curves must
/// solve Herglotz' equations up to a misfit that falls from the one to the other as it does where the motion is smooth. The search ends
/// a run at the first step that does not resolve the motion, so that runs that are far too coarse cost nothing. The error of the
/// integrator's own runs is then their distance from the reference.
///
/// Where `terminal` ends the run, all these end there.
pub(super) fn choose<'p, L: Lagrangian<N>, const N: usize>(
    request: &Request<'p, L, N>,
    wanted: f64,
    terminal: Option<Terminal<'_, N>>,
) -> Result<Choice<'p, L, N>, InputError> {
    if !(wanted > 0.0 && wanted.is_finite()) {
        return Err(InputError::Tolerance { wanted });
    }
    let choose = |request: &Request<'p, L, N>| {
        choose_with(&mut Pilots::new(request, wanted)).map_err(|refused| request.by_rounding_of_velocity(refused))
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
pub(super) fn choose_with<'p, L: Lagrangian<N>, const N: usize>(
    pilots: &mut Pilots<'_, 'p, L, N>,
) -> Result<Choice<'p, L, N>, InputError> {
    let wanted = pilots.wanted;
    let Some(integrator) = pilots.request.integrator.clone() else { return choose_all(pilots) };
    let facts = integrator.facts();
    match facts.collocation {
        Some(stages) if stages >= OWN && facts.by_clock => Ok(by_clock(pilots, &integrator, stages)?),
        Some(stages) if stages >= OWN => Ok(by_equal_steps(pilots, &integrator, stages)?),
        _ => {
            let at = if facts.by_clock { Compared::Times } else { Compared::Tenths };
            let found = converge(pilots, REFERENCE, wanted / 8.0, at)?;
            by_reference(pilots, &integrator, &found)
        }
    }
}

/// The same where no integrator is named.
fn choose_all<'p, L: Lagrangian<N>, const N: usize>(
    pilots: &mut Pilots<'_, 'p, L, N>,
) -> Result<Choice<'p, L, N>, InputError> {
    let gauss = |stages: usize| -> Shared<'p, L, N> { Arc::new(GaussCollocation { stages }) };
    let mut stages = stages_along(pilots.request, pilots.wanted);
    pilots.watches_clock = const { L::HAS_CLOCK } && pilots.request.problem.structure.autonomous;
    pilots.watches_newton = stages > STAGES;
    // Parts that end where a kink is hidden would agree on a wrong motion: only where all kinks are known are steps divided.
    let divides = const { L::PROVED || L::HAS_SWITCHING_FUNCTIONS };
    pilots.watches_uneven = divides;
    let mut found = by_equal_steps(pilots, &gauss(stages), stages);
    pilots.watches_newton = false;
    if let Err(Ended::Elsewhere(Elsewhere::FewerStages)) = found {
        stages = STAGES;
        found = by_equal_steps(pilots, &gauss(stages), stages);
    }
    (pilots.watches_clock, pilots.watches_uneven) = (false, false);
    if let Err(Ended::Elsewhere(Elsewhere::Divided)) = found {
        match divided_steps(pilots) {
            Ok(choice) => return Ok(choice),
            Err(interrupted @ InputError::Interrupted) => return Err(interrupted),
            Err(_) => found = by_equal_steps(pilots, &gauss(stages), stages),
        }
    }
    // Where a part of the motion asks for much shorter steps than the rest, those are divided; and they are refused for the first reason.
    if let Err(Ended::Refused(refused @ InputError::Accuracy { cause, .. })) = &found
        && divides
        && !matches!(cause, Obstacle::RoundOff | Obstacle::Chaos { .. })
    {
        return divided_steps(pilots).map_err(|divided| match divided {
            InputError::Accuracy { reached, .. } if reached.is_finite() => divided,
            InputError::Interrupted => divided,
            _ => *refused,
        });
    }
    let Err(Ended::Elsewhere(Elsewhere::Clock)) = found else { return Ok(found?) };
    // Where the clock leads nowhere equal steps may.
    let clocked: Shared<'p, L, N> = Arc::new(ClockedGauss { stages: BY_CLOCK });
    Ok(by_clock(pilots, &clocked, BY_CLOCK).or_else(|ended| match ended {
        Ended::Refused(InputError::Interrupted) => Err(ended),
        _ => by_equal_steps(pilots, &gauss(stages), stages),
    })?)
}

/// How a search ends that finds no runs that agree.
enum Ended {
    Refused(InputError),
    /// Another integrator is cheaper; pilot runs that watch for that end there.
    Elsewhere(Elsewhere),
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

/// Where pilot runs are compared.
#[derive(Clone, Copy)]
enum Compared {
    /// At the ends of steps next to tenths of the span.
    Steps,
    /// At tenths of the span, which divide the numbers of steps.
    Tenths,
    /// At tenths of the span; the runs are by the motion's clock.
    Times,
}

/// Gauss collocation that is its own reference, with equal steps.
fn by_equal_steps<'p, L: Lagrangian<N>, const N: usize>(
    pilots: &mut Pilots<'_, 'p, L, N>,
    integrator: &Shared<'p, L, N>,
    stages: usize,
) -> Result<Choice<'p, L, N>, Ended> {
    let wanted = pilots.wanted;
    let found = converge(pilots, stages, wanted, Compared::Steps)?;
    // Where W or the drag changes along the motion a longer step may leave their domain, as no misfit foretells.
    let structure = &pilots.request.problem.structure;
    let longer = structure.separable && structure.has_constant_rate();
    let (count, error) = fewest(stages, wanted, &found, longer);
    Ok(chosen(pilots, integrator, count, error, &found))
}

/// The same with steps that are equal in the time of the motion's clock.
fn by_clock<'p, L: Lagrangian<N>, const N: usize>(
    pilots: &mut Pilots<'_, 'p, L, N>,
    integrator: &Shared<'p, L, N>,
    stages: usize,
) -> Result<Choice<'p, L, N>, Ended> {
    let wanted = pilots.wanted;
    let found = converge(pilots, stages, wanted, Compared::Times)?;
    let (count, error) = fewest(stages, wanted, &found, false);
    Ok(chosen(pilots, integrator, count, error, &found))
}

/// The choice of steps of which so many fill the span; by a clock they are counted anew, in its time.
fn chosen<'p, L: Lagrangian<N>, const N: usize>(
    pilots: &Pilots<'_, 'p, L, N>,
    integrator: &Shared<'p, L, N>,
    count: usize,
    error: f64,
    found: &Converged<N>,
) -> Choice<'p, L, N> {
    let (h, integrator, error) = (pilots.step(count, &found.marks), integrator.clone(), Some(error));
    if let Marks::Times = found.marks {
        // The last step is about half of the others, so that no rounding adds one.
        let count = (found.truth.tau / h + 0.5).ceil().max(1.0);
        return Choice { integrator, count: count as usize, h: found.truth.tau / (count - 0.5), error, ended: None };
    }
    Choice { integrator, count, h, error, ended: None }
}

/// Finds the runs that agree.
fn converge<L: Lagrangian<N>, const N: usize>(
    pilots: &mut Pilots<'_, '_, L, N>,
    stages: usize,
    goal: f64,
    compared: Compared,
) -> Result<Converged<N>, Ended> {
    let refuse = |wanted, reached, cause| Err(InputError::Accuracy { wanted, reached, cause }.into());
    let (wanted, t0, span) = (pilots.wanted, pilots.request.problem.t0, pilots.request.span);
    let s = stages as f64;
    let marks_of = |k: usize| match compared {
        Compared::Steps => Marks::of(k),
        Compared::Tenths => Marks::equal(k),
        Compared::Times => Marks::Times,
    };
    let mut k = first_guess(pilots.request, stages, goal);
    let first = k.max(LONG / UNEVEN);
    let mut marks = marks_of(k);
    let (mut best, mut strikes, mut narrows, mut halts) = (f64::INFINITY, 0, 0, (0, 0.0));
    // The smallest distance of two runs, whatever a third one says; and what keeps them from agreeing.
    let (mut nearest, mut cause) = (f64::INFINITY, Obstacle::Budget);
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
        let left = pilots.reserve;
        let mut tracks = Vec::with_capacity(2);
        for (multiple, closely) in [(1, false), (2, true)] {
            if let Some(track) = known.take() {
                tracks.push(track);
                continue;
            }
            let ending = pilots.gauss(stages, multiple * k, &marks, closely, narrows < NARROWS)?;
            let stopped = match ending {
                PilotEnd::Followed(track) => {
                    // The error is about the square of the misfit: what is far too large need not be halved again and again.
                    let more = (track.misfit.powi(2) / goal).powf(0.5 / s) / 1.4;
                    if multiple == 1 && !guessed && more > 1.2 {
                        guessed = true;
                        k = (k as f64 * more.min(4.0)).ceil() as usize;
                        continue 'search;
                    }
                    tracks.push(track);
                    continue;
                }
                PilotEnd::Elsewhere(elsewhere) => return Err(Ended::Elsewhere(elsewhere)),
                PilotEnd::Interrupted => return Err(InputError::Interrupted.into()),
                PilotEnd::Exhausted => {
                    let told = matches!(cause, Obstacle::Misfit { .. } | Obstacle::Hidden { .. });
                    return refuse(
                        wanted,
                        nearest,
                        if nearest.is_finite() && !told { Obstacle::Budget } else { cause },
                    );
                }
                PilotEnd::Narrow { part } => {
                    narrows += 1;
                    (part, Obstacle::Unresolved { t: t0 + part * span })
                }
                PilotEnd::Unresolved { part } => (part, Obstacle::Unresolved { t: t0 + part * span }),
                PilotEnd::Halted { part, cause: halt } => (part, Obstacle::Halted { t: t0 + part * span, cause: halt }),
            };
            let (part, obstacle) = stopped;
            // What is narrow may need many halvings, what is singular has no end of them.
            let same = (part - halts.1).abs() <= 0.01 && k > LONG;
            (halts, cause) = ((if same { halts.0 + 1 } else { 1 }, part), obstacle);
            if pilots.watches_uneven && k >= UNEVEN * first {
                return Err(Ended::Elsewhere(Elsewhere::Divided));
            }
            if halts.0 == HALTS {
                break 'search;
            }
            k *= 2;
            continue 'search;
        }
        let [coarse, fine] = tracks.as_slice() else { break };
        // Runs that agree in all digits may still be off by half of the last one.
        let error = larger(coarse.distance(fine), 0.5 * f64::EPSILON);
        // A misfit of a smooth motion falls with the order s. What jumps has one that does not; what is rounded has none to speak of.
        let falls = fine.misfit <= larger(coarse.misfit / 8.0, larger(0.01 * wanted, 1e-11));
        let fall = (coarse.misfit / fine.misfit).log2();
        let order = if fall.is_nan() { s } else { fall.clamp(0.0, s) };
        // What is left of the error in the finer run: it is of the order 2s, where the misfit is of the order s.
        let beyond = error / 2.0f64.powf(1.5 * order);
        let distances = coarse.distances(fine);
        // Round-off does not fall; it grows like the distances of the runs.
        let growth = distances.last().copied().unwrap_or(0.0) / distances.first().copied().unwrap_or(0.0);
        let rounded = 2e-15 * larger(growth, 1.0) * (k as f64).sqrt();
        let agreed = error <= 0.25 * goal || (error <= 1e-2 && beyond <= 0.1 * goal && rounded <= 0.1 * goal);
        let mut hidden = None;
        if falls && agreed {
            hidden = beside_nodes(pilots, stages, k, compared, goal, fine)?;
        }
        if falls && agreed && hidden.is_none() {
            return Ok(Converged {
                k,
                errors: [error, beyond],
                misfit: coarse.misfit,
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
        let error = larger(error, hidden.unwrap_or(0.0));
        strikes = if error < 0.5 * best { 0 } else { strikes + 1 };
        cause = if !falls && agreed {
            Obstacle::Misfit { misfit: fine.misfit, order }
        } else if !falls {
            Obstacle::Order { order }
        } else if let Some(distance) = hidden {
            Obstacle::Hidden { distance }
        } else if before.is_nan() {
            // The first two runs show no order, and are the last if others would cost too much.
            Obstacle::Budget
        } else if fine.has_underflown() {
            Obstacle::RoundOff
        } else {
            obstacle(&distances, (before / error).log2(), wanted, t0, span)
        };
        (best, before) = (if error < best { error } else { best }, error);
        nearest = if apart < nearest { apart } else { nearest };
        // Not begun, if it cannot end.
        let affordable = pilots.left.max(pilots.reserve);
        if strikes == 3 || 2 * (left - pilots.reserve) > affordable {
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
    pilots: &mut Pilots<'_, '_, L, N>,
    stages: usize,
    k: usize,
    compared: Compared,
    goal: f64,
    fine: &Track<N>,
) -> Result<Option<f64>, InputError> {
    let structure = &pilots.request.problem.structure;
    if const { L::PROVED } || matches!(compared, Compared::Times) || structure.quadratic && structure.autonomous {
        return Ok(None);
    }
    Ok(match pilots.gauss(stages, k + 1, &Marks::of(k + 1), false, false)? {
        PilotEnd::Followed(track) => {
            Some(track.distance_at_end(fine)).filter(|distance| distance.is_nan() || *distance > goal)
        }
        PilotEnd::Exhausted => None,
        _ => Some(f64::INFINITY),
    })
}

/// What keeps runs from agreeing, by their distances along the motion and the order that they show.
pub(super) fn obstacle(distances: &[f64], order: f64, wanted: f64, t0: f64, span: f64) -> Obstacle {
    let (first, last) = (distances.first().copied().unwrap_or(0.0), distances.last().copied().unwrap_or(0.0));
    // The order that is left where runs differ by nothing but what they have rounded.
    let noise = order < 2.0;
    if noise && last > 1e-8 && last > 1e4 * first {
        let kept = distances.iter().take_while(|d| **d <= wanted).count();
        return Obstacle::Chaos { t: t0 + span * kept as f64 / distances.len() as f64 };
    }
    // Where only roundings are left they may show any order.
    if noise && last < 1e-9 || last <= 64.0 * f64::EPSILON { Obstacle::RoundOff } else { Obstacle::Order { order } }
}

/// The fewest steps of a Gauss method that the converged runs allow, with the error that they predict.
fn fewest<const N: usize>(stages: usize, wanted: f64, found: &Converged<N>, longer: bool) -> (usize, f64) {
    let Converged { k, errors: [error, beyond], misfit, order, finer_is_cheaper, rough, .. } = *found;
    // Ten times as exactly as wanted between the runs and beyond them, as errors of neighbouring steps may differ so much.
    let (target, predicted) = (0.2 * wanted, 0.02 * wanted);
    let steps = |order: f64| (k as f64 * (larger(error, 1e-14) / predicted).powf(1.0 / order)).ceil();
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
        let coarser = misfit * (k as f64 / fewer).powf(stages as f64);
        return if longer && fewer < k as f64 && coarser <= 1e-2 { (fewer as usize, predicted) } else { (k, error) };
    }
    // That of shorter steps falls like the square of the misfit.
    let more = steps(2.0 * order);
    if more < 2.0 * k as f64 { (more as usize, larger(predicted, beyond)) } else { (2 * k, beyond) }
}

#[cfg(test)]
mod tests;
