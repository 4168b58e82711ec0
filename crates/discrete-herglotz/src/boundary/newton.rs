//! Newton's method with a line search for the discrete Herglotz equations of a whole path.

use super::critical_path::{CriticalPath, PathStatus};
use super::deflation::Deflation;
use super::sweep::{Equations, Measured, Nodes, Sweep};
use crate::{DiscreteLagrangian, last_correction};
use contact_geom::larger;
use contact_geom::nalgebra::SVector;

/// The corrections that a search may make.
const LIMIT: u32 = 200;
/// The halvings of one correction, beyond which the path no longer moves.
const HALVINGS: u32 = 30;
/// What the relative residual of a path at round-off may be: rounded positions leave some units in the last place of the terms,
/// and a discrete Lagrangian that is found by an iteration some more.
const ROUND_OFF: f64 = 1024.0 * f64::EPSILON;

/// The sum of squares that corrections lessen, each coordinate's in units of its largest terms.
fn merit<const N: usize>(at: &Measured<N>, sizes: &SVector<f64, N>) -> f64 {
    (0..N).filter(|&i| at.squares[i] != 0.0).map(|i| at.squares[i] / sizes[i].powi(2)).sum()
}

/// The largest part of its coordinate's size that a correction changes.
fn relative<const N: usize>(change: &[SVector<f64, N>], x: &[SVector<f64, N>]) -> f64 {
    let (mut off, mut size) = (SVector::<f64, N>::zeros(), SVector::<f64, N>::zeros());
    for (dq, q) in change.iter().zip(x) {
        for i in 0..N {
            off[i] = larger(off[i], dq[i].abs());
            size[i] = larger(size[i], q[i].abs() + dq[i].abs());
        }
    }
    (0..N).filter(|&i| off[i] != 0.0).fold(0.0, |worst, i| larger(worst, off[i] / size[i]))
}

/// Searches from a path, away from known ones.
///
/// A correction is halved until the sum of the squares of the residuals falls. The search ends where the next correction,
/// predicted from the last two, is below round-off, or where corrections stagnate with residuals at round-off.
pub(super) fn search<D: DiscreteLagrangian<N>, const N: usize>(
    of: &Equations<'_, D, N>,
    mut x: Nodes<N>,
    deflation: &Deflation<'_, N>,
) -> CriticalPath<N> {
    let mut sweep = Sweep::new(of);
    let (mut change, mut trial) = (x.q.clone(), x.clone());
    let mut at = match sweep.forward(of, &mut x) {
        Ok(at) => at,
        Err(e) => return CriticalPath::ended(PathStatus::Undefined { step: e.step, cause: e.cause }, x, 0),
    };
    let least = 16.0 * of.steps as f64 * f64::EPSILON;
    let mut before = f64::INFINITY;
    for iterations in 1..=LIMIT {
        // Not `<=`, which would let a NaN pass.
        if !(at.regularity > least) {
            let status = PathStatus::Conjugate { regularity: at.regularity };
            return CriticalPath::ended(status, x, iterations - 1).measured(&at);
        }
        sweep.backward(of, &mut change);
        let (repulsion, stretch) = deflation.of(&x.q, &change);
        let (mut part, mut halvings) = (1.0, 0);
        let next = loop {
            for ((to, from), dq) in trial.q.iter_mut().zip(&x.q).zip(&change) {
                *to = from + dq * (part * stretch);
            }
            if let Ok(next) = sweep.forward(of, &mut trial) {
                let sizes = at.sizes.sup(&next.sizes);
                let now = merit(&at, &sizes) * repulsion.powi(2);
                let then = merit(&next, &sizes) * deflation.factor(&trial.q).powi(2);
                if then <= (1.0 - 1e-4 * part) * now || next.relative <= ROUND_OFF {
                    break Some(next);
                }
            }
            part *= 0.5;
            halvings += 1;
            if halvings > HALVINGS {
                break None;
            }
        };
        let Some(next) = next else {
            return CriticalPath::ended(PathStatus::Stalled, x, iterations).measured(&at);
        };
        let size = relative(&change, &x.q) * part * stretch.abs();
        std::mem::swap(&mut x, &mut trial);
        at = next;
        let predicted = part == 1.0 && last_correction(size, before, f64::EPSILON);
        let stagnant = size >= 0.5 * before && size <= f64::EPSILON.sqrt();
        if at.relative <= ROUND_OFF && (predicted || stagnant) {
            let status = match at.not_contact {
                Some((step, sigma)) => PathStatus::SigmaVanished { step, sigma },
                None => PathStatus::Found,
            };
            return CriticalPath::ended(status, x, iterations).measured(&at);
        }
        before = if part == 1.0 { size } else { f64::INFINITY };
    }
    CriticalPath::ended(PathStatus::NotConverged, x, LIMIT).measured(&at)
}
