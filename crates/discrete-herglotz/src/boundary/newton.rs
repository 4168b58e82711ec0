//! Newton's method with a line search for the discrete Herglotz equations of a whole path.

use super::block_elimination::{BlockElimination, Equations, Measured, Nodes};
use super::critical_path::{CriticalPath, PathStatus};
use super::deflation::Deflation;
use super::path_check::{PathCheck, check_path};
use crate::{DiscreteLagrangian, solve::last_correction};
use contact_geom::nalgebra::SVector;

/// The largest number of corrections of a search: a search that succeeds needs a few, and some dozens if it first
/// leaves local minima of the residual.
const MAX_CORRECTIONS: u32 = 200;

/// The largest number of halvings of one correction; after these, at a four thousandth of its length, the residual does
/// not decrease along it.
const MAX_HALVINGS: u32 = 12;

/// The largest number of full corrections that are taken although the residual does not decrease, since local minima of
/// the residual that are not critical paths are common.
const MAX_FULL_CORRECTIONS: u32 = 12;

/// The smallest decrease of the merit function, relative to that of the linearised equations, with which a correction
/// is accepted: Armijo's condition, which excludes steps that only seem to decrease it.
const MIN_RELATIVE_DECREASE: f64 = 1e-4;

/// The number of roundings of a pivot for each step, below which the ends are conjugate to round-off.
const PIVOT_ROUNDINGS: f64 = 16.0;

/// The bound for the relative residual of a path at round-off: the round-off of the positions contributes some units in
/// the last place of the terms, and a discrete Lagrangian that is computed by an iteration some more.
const MAX_RELATIVE_RESIDUAL: f64 = 1024.0 * f64::EPSILON;

/// The merit function of the line search: the sum of the squares of the residuals, for each coordinate in units of its
/// largest terms.
fn merit<const N: usize>(at: &Measured<N>, sizes: &SVector<f64, N>) -> f64 {
    (0..N).filter(|&i| at.squares[i] != 0.0).map(|i| at.squares[i] / sizes[i].powi(2)).sum()
}

/// Multiplies the difference between two paths by a factor.
fn shorten<const N: usize>(from: &[SVector<f64, N>], to: &mut [SVector<f64, N>], part: f64) {
    if part != 1.0 {
        for (to, from) in to.iter_mut().zip(from) {
            *to = from + (*to - from) * part;
        }
    }
}

/// Searches for a critical path from an initial one, away from known ones.
///
/// A correction is halved until the sum of the squares of the residuals decreases. The search succeeds where the next
/// correction, predicted from the last two, is below round-off, or where corrections stagnate with residuals at
/// round-off. If it fails, the result is the path with the smallest residual among those at which the line search
/// failed.
pub(super) fn search<D: DiscreteLagrangian<N>, const N: usize>(
    of: &Equations<'_, D, N>,
    mut x: Nodes<N>,
    deflation: &Deflation<'_, N>,
) -> CriticalPath<N> {
    let mut elimination = BlockElimination::new(of);
    let first = x.q.iter().fold(SVector::zeros(), |most: SVector<f64, N>, q| most.sup(&q.abs()));
    let mut trial = x.clone();
    let mut at = match elimination.forward(of, &mut x) {
        Ok(at) => at,
        Err(e) => return CriticalPath::ended(PathStatus::Undefined { step: e.step, cause: e.cause }, x, 0),
    };
    let least = PIVOT_ROUNDINGS * of.steps as f64 * f64::EPSILON;
    let mut before = f64::INFINITY;
    // The path with the smallest residual among those at which the line search failed.
    let mut best: Option<(Nodes<N>, Measured<N>)> = None;
    let mut full_corrections = 0;
    for iterations in 1..=MAX_CORRECTIONS {
        if at.regularity.is_nan() || at.regularity <= least {
            let status = PathStatus::Conjugate { regularity: at.regularity };
            return CriticalPath::ended(status, x, iterations - 1).measured(&at);
        }
        let extent = elimination.backward(of, &x.q, &mut trial.q);
        let (repulsion, stretch) = deflation.of(&x.q, &trial.q);
        shorten(&x.q, &mut trial.q, stretch);
        let (mut part, mut halvings, mut is_full) = (1.0, 0, false);
        let next = loop {
            if let Ok(next) = elimination.forward(of, &mut trial) {
                let sizes = at.sizes.sup(&next.sizes);
                let now = merit(&at, &sizes) * repulsion.powi(2);
                let then = merit(&next, &sizes) * deflation.factor(&trial.q).powi(2);
                if is_full
                    || then <= (1.0 - MIN_RELATIVE_DECREASE * part) * now
                    || next.relative <= MAX_RELATIVE_RESIDUAL
                {
                    break Some(next);
                }
            }
            part *= 0.5;
            halvings += 1;
            if halvings <= MAX_HALVINGS {
                shorten(&x.q, &mut trial.q, 0.5);
            } else {
                if is_full || full_corrections == MAX_FULL_CORRECTIONS {
                    break None;
                }
                if best.as_ref().is_none_or(|(_, best)| at.residual < best.residual) {
                    best = Some((x.clone(), at));
                }
                // Take the full correction without a line search.
                shorten(&x.q, &mut trial.q, f64::from(1 << MAX_HALVINGS));
                (part, halvings, is_full) = (1.0, 0, true);
                full_corrections += 1;
            }
        };
        let Some(next) = next else {
            let (x, at) = best.filter(|(_, best)| best.residual <= at.residual).unwrap_or((x, at));
            return CriticalPath::ended(PathStatus::Stalled, x, iterations).measured(&at);
        };
        let size = extent.relative(&first) * part * stretch.abs();
        std::mem::swap(&mut x, &mut trial);
        at = next;
        let predicted = part == 1.0 && last_correction(size, before, f64::EPSILON);
        let stagnant = size >= 0.5 * before && size <= f64::EPSILON.sqrt();
        let still = part == 1.0 && size <= f64::EPSILON;
        if still || at.relative <= MAX_RELATIVE_RESIDUAL && (predicted || stagnant) {
            let status = match at.not_contact {
                Some((step, sigma)) => PathStatus::SigmaVanished { step, sigma },
                None => PathStatus::Found,
            };
            let check = if status == PathStatus::Found {
                check_path(of, &mut elimination, &mut x, &mut trial.q)
            } else {
                PathCheck::default()
            };
            return CriticalPath::ended(status, x, iterations).measured(&at).with_check(check);
        }
        before = if part == 1.0 { size } else { f64::INFINITY };
    }
    let (x, at) = best.filter(|(_, best)| best.residual <= at.residual).unwrap_or((x, at));
    CriticalPath::ended(PathStatus::NotConverged, x, MAX_CORRECTIONS).measured(&at)
}
