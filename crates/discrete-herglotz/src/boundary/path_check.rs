//! Checks whether a found path approximates a motion: its steps resolve it, and the effect of their truncation error is
//! small compared with its range.

use super::block_elimination::{BlockElimination, Carry, Equations, Nodes};
use crate::resolution::monitor::{at_rest, rounding};
use crate::resolution::thresholds::{MAX_PATH_ERROR, POSITION_ROUND_OFF};
use crate::{DiscreteLagrangian, UnresolvedStep};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    PhasePoint,
    numbers::{max_abs_or_nan, max_or_nan},
};

/// The coefficient of the truncation error of a second-order rule in the equation of a point, in third differences of
/// the momenta. For an oscillator the error is `h^3 p'''/12` for the trapezoidal rule and the Strang splitting, and
/// twice as much for the midpoint rule.
const TRUNCATION_COEFFICIENT: f64 = 1.0 / 6.0;

/// The result of the checks of a path.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PathCheck {
    /// The first unresolved step.
    pub unresolved: Option<UnresolvedStep>,
    /// The effect of the truncation error on the path, in units of its range; `None` where the truncation error is
    /// unknown.
    pub error_estimate: Option<f64>,
}

/// Checks a path that satisfies its equations, directly after its last elimination.
///
/// The velocities of its steps are checked as in a run. In addition, the linearised equations give the correction of
/// the path by the leading term of the truncation error. It is as large as the path where the ends are conjugate to
/// within that error, which the pivots of the factorisation do not show. `to` is workspace.
pub(super) fn check_path<D: DiscreteLagrangian<N>, const N: usize>(
    of: &Equations<'_, D, N>,
    elimination: &mut BlockElimination<N>,
    x: &mut Nodes<N>,
    to: &mut [SVector<f64, N>],
) -> PathCheck {
    let turn = first_unresolved(of, &elimination.momenta, x);
    let moved = moved(of, elimination, x, to);
    let beyond = moved.filter(|(part, _)| *part > MAX_PATH_ERROR);
    let of_ends = beyond.map(|(part, step)| UnresolvedStep { step, defect: part / MAX_PATH_ERROR });
    PathCheck { unresolved: turn.or(of_ends), error_estimate: moved.map(|(part, _)| part) }
}

/// The first step that does not resolve the motion, by the velocities of four consecutive steps.
fn first_unresolved<D: DiscreteLagrangian<N>, const N: usize>(
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
            floor = rounding(q0.as_slice(), last.as_slice(), h);
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

/// The largest effect of the truncation error on a coordinate, relative to its range, and the step where it occurs;
/// infinite where the linearised equations are singular.
fn moved<D: DiscreteLagrangian<N>, const N: usize>(
    of: &Equations<'_, D, N>,
    elimination: &mut BlockElimination<N>,
    x: &mut Nodes<N>,
    to: &mut [SVector<f64, N>],
) -> Option<(f64, usize)> {
    // A third difference needs four momenta.
    let momenta = elimination.momenta.as_slice();
    let last = momenta.len().checked_sub(4)?;
    // The error of a rule of order one in the forces is not that of the drag below.
    let order = of.ld.order().filter(|order| *order == 2 || *order < 2 && !of.ld.has_forces())?;
    let defect = |k: usize| {
        let i = k.saturating_sub(2).min(last);
        let p = |j: usize| momenta[i + j].p;
        let third = (p(3) - p(0) + (p(1) - p(2)) * 3.0) * TRUNCATION_COEFFICIENT;
        // A rule of order one evaluates z, or the momentum on which the drag acts, at the start of a step.
        let Carry { p: here, dz: drag, .. } = momenta[k.saturating_sub(1)];
        let change = momenta[k.max(1)].p - momenta[k.max(1) - 1].p;
        if order == 1 { third + (change + here * drag) * (0.5 * drag) } else { third }
    };
    let first = usize::from(!of.conditions.is_periodic());
    let load: Vec<_> = (0..of.steps).map(|k| if k < first { SVector::zeros() } else { defect(k) }).collect();
    let loaded = Equations { ld: of.ld, conditions: of.conditions, t0: of.t0, steps: of.steps, load: &load };
    let measured = elimination.forward(&loaded, x).ok()?;
    if measured.regularity.is_nan() || measured.regularity <= 0.0 {
        return Some((f64::INFINITY, 0));
    }
    elimination.backward(&loaded, &x.q, to);
    let (mut low, mut high) = (x.q[0], x.q[0]);
    for q in &x.q {
        (low, high) = (low.inf(q), high.sup(q));
    }
    let (range, size) =
        (high - low, max_or_nan(max_abs_or_nan(low.iter().copied()), max_abs_or_nan(high.iter().copied())));
    let mut worst = (0.0, 0);
    for (k, (to, q)) in to.iter().zip(&x.q).enumerate() {
        // The range of a constant coordinate is round-off.
        let parts = (0..N).filter(|&i| range[i] > POSITION_ROUND_OFF * size).map(|i| (to[i] - q[i]).abs() / range[i]);
        let part = parts.fold(0.0, max_or_nan);
        if part.is_nan() || part > worst.0 {
            worst = (if part.is_nan() { f64::INFINITY } else { part }, k.min(of.steps - 1));
        }
    }
    Some(worst)
}
