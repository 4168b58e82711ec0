//! Whether a found path is a motion: its steps resolve it, and what they leave out does not move it by as much as it moves.

use super::block_elimination::{BlockElimination, Carry, Equations, Nodes};
use crate::resolution::monitor::{ROUNDED, at_rest, rounding};
use crate::{DiscreteLagrangian, UnresolvedStep};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    PhasePoint,
    numbers::{max_abs_or_nan, max_or_nan},
};

/// The part of its range by which the steps may move a path that they resolve.
const LARGEST_CORRECTION: f64 = 0.25;

/// What a second-order rule leaves out of the equation of a point, in third differences of the momenta: `h^3 p'''/12` by the trapezoidal rule and
/// kicks and drifts, of an oscillator, and twice as much by the midpoint rule.
const DEFECT: f64 = 1.0 / 6.0;

/// What was seen of a path.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Judgement {
    /// The first step that cannot have resolved the motion.
    pub unresolved: Option<UnresolvedStep>,
    /// By how much the steps move the path, in units of its range; `None` where it is not known what they leave out.
    pub error_estimate: Option<f64>,
}

/// Judges a path that satisfies its equations, of which the last sweep was. The velocities of its steps are looked at as those of a run; and the
/// correction is found that the leading term of the error of the steps makes, by the equations linearised there: it is as large as the path where
/// the ends are conjugate to within that error, though the factorisation sees nothing of it. `to` is workspace.
pub(super) fn judge<D: DiscreteLagrangian<N>, const N: usize>(
    of: &Equations<'_, D, N>,
    sweep: &mut BlockElimination<N>,
    x: &mut Nodes<N>,
    to: &mut [SVector<f64, N>],
) -> Judgement {
    let turn = look(of, &sweep.momenta, x);
    let moved = moved(of, sweep, x, to);
    let beyond = moved.filter(|(part, _)| *part > LARGEST_CORRECTION);
    let of_ends = beyond.map(|(part, step)| UnresolvedStep { step, defect: part / LARGEST_CORRECTION });
    Judgement { unresolved: turn.or(of_ends), error_estimate: moved.map(|(part, _)| part) }
}

/// The first step that does not resolve the motion by the velocities of four in sequence.
fn look<D: DiscreteLagrangian<N>, const N: usize>(
    of: &Equations<'_, D, N>,
    momenta: &[Carry<N>],
    x: &Nodes<N>,
) -> Option<UnresolvedStep> {
    let h = of.ld.step_size();
    let mut velocities = [SVector::zeros(); 4];
    let mut floor = 0.0;
    for (k, Carry { p, sigma, .. }) in momenta.iter().enumerate() {
        let (q0, q1) = (x.q[k], x.q[k + 1]);
        velocities = [velocities[1], velocities[2], velocities[3], (q1 - q0) / h];
        let [.., last] = &velocities;
        if k == 0 {
            floor = rounding(&q0, last, h);
        }
        if k < 3 {
            continue;
        }
        // From the fourth step on all four are velocities of the path.
        let four = velocities.each_ref();
        let to = PhasePoint { q: q1, p: *p, z: x.z[k + 1] };
        if let Some(defect) = of.ld.defect(four, &to, *sigma)
            && !at_rest(four, h, floor)
        {
            return Some(UnresolvedStep { step: k, defect });
        }
    }
    None
}

/// The largest part of its range by which the steps move a coordinate, and the step where; infinite where the equations have no solution.
fn moved<D: DiscreteLagrangian<N>, const N: usize>(
    of: &Equations<'_, D, N>,
    sweep: &mut BlockElimination<N>,
    x: &mut Nodes<N>,
    to: &mut [SVector<f64, N>],
) -> Option<(f64, usize)> {
    // A third difference has four momenta.
    let momenta = sweep.momenta.as_slice();
    let last = momenta.len().checked_sub(4)?;
    let order = of.ld.order().filter(|order| *order <= 2)?;
    let defect = |k: usize| {
        let i = k.saturating_sub(2).min(last);
        let p = |j: usize| momenta[i + j].p;
        let third = (p(3) - p(0) + (p(1) - p(2)) * 3.0) * DEFECT;
        // A rule of order one takes z, or the momentum that the drag acts on, at the start of a step.
        let Carry { p: here, dz: drag, .. } = momenta[k.saturating_sub(1)];
        let change = momenta[k.max(1)].p - momenta[k.max(1) - 1].p;
        if order == 1 { third + (change + here * drag) * (0.5 * drag) } else { third }
    };
    let first = usize::from(!of.conditions.is_periodic());
    let load: Vec<_> = (0..of.steps).map(|k| if k < first { SVector::zeros() } else { defect(k) }).collect();
    let loaded = Equations { ld: of.ld, conditions: of.conditions, t0: of.t0, steps: of.steps, load: &load };
    let measured = sweep.forward(&loaded, x).ok()?;
    if measured.regularity.is_nan() || measured.regularity <= 0.0 {
        return Some((f64::INFINITY, 0));
    }
    sweep.backward(&loaded, &x.q, to);
    let (mut low, mut high) = (x.q[0], x.q[0]);
    for q in &x.q {
        (low, high) = (low.inf(q), high.sup(q));
    }
    let (range, size) =
        (high - low, max_or_nan(max_abs_or_nan(low.iter().copied()), max_abs_or_nan(high.iter().copied())));
    let mut worst = (0.0, 0);
    for (k, (to, q)) in to.iter().zip(&x.q).enumerate() {
        // A coordinate that stays where it is has no range but its rounding.
        let parts = (0..N).filter(|&i| range[i] > ROUNDED * size).map(|i| (to[i] - q[i]).abs() / range[i]);
        let part = parts.fold(0.0, max_or_nan);
        if part.is_nan() || part > worst.0 {
            worst = (if part.is_nan() { f64::INFINITY } else { part }, k.min(of.steps - 1));
        }
    }
    Some(worst)
}
