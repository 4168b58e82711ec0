//! Splittings and compositions by their own entry points: in chunks, with compensated sums, without the action.

use super::problem::Problem;
use super::random_numbers::RandomNumbers;
use super::verdict::{Checked, Kind, Verdict, Wrong, ended, ensure, refused};
use contact_geom::{ChartVector, PhasePoint, legendre};
use discrete_herglotz::{
    InputError, RunSupport, SplittingScheme, StepFailure,
    splitting::{ActionSplitting, Splitting},
};

pub fn splitting<const N: usize>(problem: &Problem<N>, random: &mut RandomNumbers) -> Checked {
    let Problem { system, t0, start, .. } = problem;
    let scheme = random.pick(&SplittingScheme::ALL);
    let (h, steps) = (random.scale(1e-4, 1.0), 1 + random.below(60));
    let state = legendre(system, *t0, start);
    let chunks: Vec<usize> = (0..steps).map(|_| 1 + random.below(5)).collect();
    let linear = |compensated: bool, action: bool| {
        Splitting::new(system, &scheme, h, *t0, state).map(|s| {
            let s = if compensated { s.compensated() } else { s };
            if action { s } else { s.without_action() }
        })
    };
    match (linear(false, true), linear(true, true), linear(false, false)) {
        (Ok(plain), Ok(compensated), Ok(bare)) => {
            judge::<_, N>([plain.clone(), plain, compensated, bare], steps, &chunks)
        }
        (Err(error), ..) => {
            let of = |compensated| {
                let made = ActionSplitting::new(system, &scheme, h, *t0, state)?;
                Ok::<_, InputError>(if compensated { made.compensated() } else { made })
            };
            match (of(false), of(true)) {
                (Ok(plain), Ok(compensated)) => {
                    judge::<_, N>([plain.clone(), plain.clone(), compensated, plain], steps, &chunks)
                }
                _ => Ok(refused(&error)),
            }
        }
        _ => Err(Wrong { kind: Kind::RoutesDiffer, what: "a splitting that exists only plain".into() }),
    }
}

/// Compares four steppers from one start: the first in one piece, the second in chunks, the third with compensated
/// sums, the last without the action where the scheme has it.
fn judge<S: RunSupport, const N: usize>(mut four: [S; 4], steps: usize, chunks: &[usize]) -> Checked {
    let start = four[0].state().fixed::<N>();
    let all = four[0].advance(steps);
    let (mut taken, mut halted) = (0, Ok(()));
    for chunk in chunks {
        let chunk = (*chunk).min(steps - taken);
        if chunk > 0 && halted.is_ok() {
            halted = four[1].advance(chunk).map_err(|halt| StepFailure { taken: taken + halt.taken, ..halt });
            taken += chunk;
        }
    }
    let compensated = four[2].advance(steps);
    let bare = four[3].advance(steps);
    let ends: [PhasePoint<N>; 4] = std::array::from_fn(|i| four[i].state().fixed());
    let finite = ends.iter().all(|e| e.check().is_ok()) && four.iter().all(|s| s.sigma() >= 0.0);
    ensure(finite, Kind::NotFinite, || format!("{ends:?}"))?;
    ensure(halted == all && ends[0] == ends[1], Kind::ObservedDiffers, || {
        format!("{all:?} in one go, {halted:?} in chunks: {:?} and {:?}", ends[0], ends[1])
    })?;
    // z may end a run that continues without it.
    let same = match (all, bare) {
        (Ok(()), Ok(())) => ends[0].q == ends[3].q && ends[0].p == ends[3].p,
        (Ok(()), Err(_)) => false,
        _ => true,
    };
    ensure(same, Kind::ObservedDiffers, || format!("without the action {bare:?}, {:?} and {:?}", ends[0], ends[3]))?;
    if let (Ok(()), Ok(())) = (all, compensated) {
        let apart = ChartVector::from(ends[0]).minus(ends[2].into()).amax();
        let size = ChartVector::from(start).amax() + ChartVector::from(ends[0]).amax();
        // The growth of rounding is not known here: the difference must remain small.
        ensure(apart <= 1e-3 * size, Kind::RoutesDiffer, || {
            format!("compensated sums move the end by {apart:.1e} of {size:.1e}")
        })?;
    }
    Ok(match all {
        _ if four[0].unresolved().is_some() => Verdict::Flagged,
        Ok(()) => Verdict::Right,
        Err(halt) => ended(&halt.cause),
    })
}
