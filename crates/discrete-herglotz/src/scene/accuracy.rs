//! The integrator and the number of steps for a wanted error.

use super::pilot::{BUDGET, Ending, Pilots, Track, gcd};
use super::{Integrator, MOST_STEPS, Scene};
use crate::{InputError, Obstacle};
use contact_geom::{Lagrangian, Structure};

/// The searches that may follow each other: each makes the steps shorter, or ends.
const ATTEMPTS: usize = 64;

/// The refinements after which a step that still cannot be taken at the same time cannot be taken at all, and those after which
/// something narrow that is still between the nodes is left to the comparison of runs.
const HALTS: usize = 16;
const NARROWS: usize = 10;

/// The stages of the reference for other methods.
const REFERENCE: usize = 12;

/// The stages from which a Gauss method is its own reference.
const OWN: usize = 6;

/// The times of a span at which runs are compared.
const MARKS: usize = 10;

/// What is chosen for a scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Choice {
    pub integrator: Integrator,
    pub count: usize,
    /// The error that the pilot runs found, or predict; `None` where the steps are given.
    pub error: Option<f64>,
}

/// A motion that runs with k, 2k and 3k steps agree on.
struct Converged<const N: usize> {
    k: usize,
    /// The errors of the runs with k and 2k steps.
    errors: [f64; 2],
    /// The order that the two show.
    order: f64,
    truth: Track<N>,
    /// Whether something narrow was met on the way.
    narrow: bool,
}

/// The stages of Gauss collocation for an error, where no integrator is named: the more the smaller the error, since a stage in the
/// lanes of a register costs little; fewer where z drives the motion, as the iteration then contracts more slowly.
fn stages_for(structure: &Structure, wanted: f64) -> usize {
    let condensed = structure.separable && structure.has_constant_rate();
    match wanted {
        _ if structure.quadratic && structure.autonomous && condensed => 16,
        e if condensed && e < 1e-9 => 16,
        e if condensed && e < 1e-4 => 12,
        e if !condensed && e < 1e-10 => 12,
        _ => 8,
    }
}

/// Chooses the steps, and the integrator where the scene names none, so that the error of (q, p), relative to their size, is at most
/// `wanted` at ten times along the motion.
///
/// A reference is found first: contact Gauss collocation with k, 2k and 3k steps, whose agreement must show an order, and whose
/// curves must solve Herglotz' equations between their nodes. It ends as soon as a step does not resolve the motion, so that runs that
/// are far too coarse cost nothing. The error of the integrator's own runs is then their distance from the reference.
pub(super) fn choose<L: Lagrangian<N>, const N: usize>(
    scene: &Scene<'_, L, N>,
    wanted: f64,
) -> Result<Choice, InputError> {
    if !(wanted > 0.0 && wanted.is_finite()) {
        return Err(InputError::Tolerance { wanted });
    }
    let mut pilots = Pilots { scene, left: BUDGET, wanted };
    let structure = scene.lagrangian.structure();
    let integrator = scene.integrator.unwrap_or(Integrator::Gauss { stages: stages_for(&structure, wanted) });
    match integrator {
        Integrator::Gauss { stages } if stages >= OWN => {
            let found = converge(&mut pilots, stages, wanted)?;
            let (count, error) = fewest(&mut pilots, stages, found)?;
            Ok(Choice { integrator, count, error: Some(error) })
        }
        _ => {
            let found = converge(&mut pilots, REFERENCE, wanted / 8.0)?;
            by_reference(&mut pilots, integrator, &found)
        }
    }
}

/// The steps of a quarter of a radian a stage of the fastest frequency of the motion linearised at its start.
fn first_guess<L: Lagrangian<N>, const N: usize>(scene: &Scene<'_, L, N>, stages: usize) -> usize {
    let Scene { lagrangian, start, t0, span, .. } = scene;
    let h = lagrangian.hessian(*t0, start);
    let squared = h.vv.try_inverse().map_or(0.0, |inverse| (inverse * h.qq).norm());
    let count = span.abs() * squared.sqrt() * 4.0 / stages as f64;
    // What is stiff at its start need not be resolved, and what is free there may be anything later.
    if count.is_finite() { (count.ceil() as usize).clamp(1, 1 << 20) } else { 1 }
}

/// Finds the runs that agree.
fn converge<L: Lagrangian<N>, const N: usize>(
    pilots: &mut Pilots<'_, '_, L, N>,
    stages: usize,
    goal: f64,
) -> Result<Converged<N>, InputError> {
    let mut k = first_guess(pilots.scene, stages);
    let refuse = |wanted, reached, cause| Err(InputError::Accuracy { wanted, reached, cause });
    let (wanted, t0, span) = (pilots.wanted, pilots.scene.t0, pilots.scene.span);
    let (mut best, mut strikes, mut narrows, mut halts) = (f64::INFINITY, 0, 0, (0, 0.0));
    let mut known: Vec<(usize, Track<N>)> = Vec::new();
    let mut cause = Obstacle::Unresolved { t: t0 };
    'search: for _ in 0..ATTEMPTS {
        if 3.0 * k as f64 > MOST_STEPS {
            break;
        }
        // The common times, where there are as many steps.
        let marks = k.min(MARKS);
        k = k.div_ceil(marks) * marks;
        let mut tracks = Vec::with_capacity(3);
        let before = pilots.left;
        for (multiple, stride) in [(1, 8), (2, 4), (3, 1)] {
            let count = multiple * k;
            if let Some((_, track)) = known.iter().find(|(n, track)| *n == count && track.0.len() == marks) {
                tracks.push(track.clone());
                continue;
            }
            let ending = pilots.gauss(stages, count, marks, stride, narrows < NARROWS)?;
            match ending {
                Ending::Followed(track) => {
                    known.push((count, track.clone()));
                    tracks.push(track);
                    continue;
                }
                Ending::Unresolved { part } => cause = Obstacle::Unresolved { t: t0 + part * span },
                Ending::Narrow { part } => {
                    cause = Obstacle::Unresolved { t: t0 + part * span };
                    narrows += 1;
                }
                Ending::Halted { part, cause: halt } => {
                    let same = (part - halts.1).abs() <= 0.01;
                    halts = (if same { halts.0 + 1 } else { 1 }, part);
                    cause = Obstacle::Halted { t: t0 + part * span, cause: halt };
                    if halts.0 == HALTS {
                        break 'search;
                    }
                }
                Ending::Exhausted => {
                    return refuse(wanted, best, if best.is_finite() { Obstacle::Budget } else { cause });
                }
            }
            k *= 2;
            continue 'search;
        }
        let [first, second, truth] = tracks.as_slice() else { break };
        let [coarse, fine] = [first.distance(truth), second.distance(truth)];
        if !(coarse + fine).is_finite() {
            k *= 2;
            continue;
        }
        let order = if fine > 0.0 { (coarse / fine).log2() } else { 2.0 * stages as f64 };
        // What is left of the error in the finest run, if it goes on like this.
        let beyond = fine / (1.5f64.powf(order.max(0.5)) - 1.0);
        let agreed = order >= 0.5 && fine + beyond <= 0.5 * goal;
        // Where runs differ by their round-off only, they show no order.
        let settled = coarse <= 0.5 * wanted && fine <= 0.5 * wanted && order < 2.0;
        if agreed || settled {
            return Ok(Converged { k, errors: [coarse, fine], order, truth: truth.clone(), narrow: narrows > 0 });
        }
        strikes = if fine < 0.5 * best { 0 } else { strikes + 1 };
        best = best.min(fine);
        cause = obstacle(&second.distances(truth), order, wanted, t0, span);
        if strikes == 3 {
            break;
        }
        let factor = if order < 0.5 { 1.6 } else { (1.2 * (fine / (0.2 * goal)).powf(1.0 / order)).clamp(1.3, 4.0) };
        // Not begun, if it cannot end: the cost of the last search, made longer.
        let spent = (before - pilots.left) as f64;
        if order >= 0.5 && spent * (fine / goal).powf(1.0 / order) > 4.0 * pilots.left as f64 {
            break;
        }
        k = (k as f64 * factor).ceil() as usize;
    }
    refuse(wanted, best, cause)
}

/// What keeps runs from agreeing, by their distances along the motion and the order that they show.
fn obstacle(distances: &[f64], order: f64, wanted: f64, t0: f64, span: f64) -> Obstacle {
    let (first, last) = (distances.first().copied().unwrap_or(0.0), distances.last().copied().unwrap_or(0.0));
    // The order that is left where runs differ by nothing but what they have rounded.
    let noise = order < 2.0;
    if noise && last > 1e-8 && last > 1e4 * first {
        let kept = distances.iter().take_while(|d| **d <= wanted).count();
        return Obstacle::Chaos { t: t0 + span * kept as f64 / distances.len() as f64 };
    }
    if noise && last < 1e-9 { Obstacle::RoundOff } else { Obstacle::Order { order } }
}

/// The fewest steps of a Gauss method that the converged runs allow, with the error that they predict.
fn fewest<L: Lagrangian<N>, const N: usize>(
    pilots: &mut Pilots<'_, '_, L, N>,
    stages: usize,
    found: Converged<N>,
) -> Result<(usize, f64), InputError> {
    let Converged { mut k, errors: [mut coarse, mut fine], mut order, truth, narrow } = found;
    let target = 0.2 * pilots.wanted;
    // Far below what is wanted, fewer steps may do.
    while coarse <= 0.01 * target && k % 2 == 0 {
        let marks = gcd(k / 2, truth.0.len());
        if marks < MARKS.min(k / 2) / 2 {
            break;
        }
        let Ending::Followed(track) = pilots.gauss(stages, k / 2, marks, 4, true)? else { break };
        let error = track.distance(&truth);
        if error > target || error.is_nan() {
            break;
        }
        (fine, coarse, k) = (coarse, error, k / 2);
        order = if fine > 0.0 { (coarse / fine).log2() } else { order };
    }
    if coarse <= target {
        return Ok((k, coarse));
    }
    // Between two runs whose errors are known and small, by the order that they show where it is nearly the method's; ten times as
    // exactly, as errors of neighbouring steps may differ so much.
    let predicted = 0.1 * target;
    if coarse <= 1e-2 && order >= stages as f64 && !narrow {
        let longer = (coarse / predicted).powf(1.0 / order);
        if longer < 2.0 {
            return Ok(((k as f64 * longer).ceil() as usize, predicted.max(fine)));
        }
    }
    Ok((2 * k, fine))
}

/// The steps of any integrator, whose runs are compared with the reference.
fn by_reference<L: Lagrangian<N>, const N: usize>(
    pilots: &mut Pilots<'_, '_, L, N>,
    integrator: Integrator,
    found: &Converged<N>,
) -> Result<Choice, InputError> {
    let wanted = pilots.wanted;
    let (order, marks) = (f64::from(integrator.order()), found.truth.0.len());
    let whole = |count: f64| (count / marks as f64).ceil().max(1.0) as usize * marks;
    let refuse = |reached, cause| Err(InputError::Accuracy { wanted, reached, cause });
    let mut count = whole((found.k * REFERENCE) as f64 / order.min(4.0));
    let (mut best, mut strikes) = (f64::INFINITY, 0);
    let (mut cause, mut before) = (Obstacle::Budget, None);
    // The fewest steps that were seen to be enough.
    let mut enough: Option<Choice> = None;
    for _ in 0..ATTEMPTS {
        if count as f64 > MOST_STEPS {
            break;
        }
        let factor = match pilots.own(integrator, count, marks)? {
            Ending::Followed(track) => {
                let error = track.distance(&found.truth);
                if error <= 0.7 * wanted {
                    enough = Some(Choice { integrator, count, error: Some(error) });
                    // Down, where an order says that much fewer steps will do.
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
                // The reference is sure, so it is no chaos that keeps a run from it.
                if let Some((n, other)) = before.replace((count, error)) {
                    let shown = f64::ln(other / error) / f64::ln(count as f64 / n as f64);
                    let round_off = error < 1e-9 && shown < 0.5 * order;
                    cause = if round_off { Obstacle::RoundOff } else { Obstacle::Order { order: shown } };
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
            Ending::Halted { part, cause: halt } => {
                if enough.is_some() {
                    break;
                }
                cause = Obstacle::Halted { t: pilots.scene.t0 + part * pilots.scene.span, cause: halt };
                2.0
            }
            _ => {
                cause = Obstacle::Budget;
                break;
            }
        };
        count = whole(count as f64 * factor);
    }
    match enough {
        Some(choice) => Ok(choice),
        None => refuse(best, cause),
    }
}
