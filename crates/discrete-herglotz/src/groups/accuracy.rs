//! The number of steps for an accuracy, by trial runs.

use super::{GroupIntegrator, GroupMotion, GroupState};
use contact_geom::groups::{GroupError, LieGroup};
use contact_geom::numbers::max_or_nan;

/// The steps that reach an accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupSteps {
    /// Their number.
    pub steps: usize,
    /// Their length.
    pub h: f64,
    /// The difference at the end from a run with half as many steps, by [`group_distance`], or from runs with other
    /// roundings, if that is larger: a bound of the error.
    pub error: f64,
}

/// The largest number of steps of a trial run.
const MAX_STEPS: usize = 1 << 24;

/// The number of steps of all trial runs, some seconds, beyond which they are continued only where the accuracy is expected
/// to be reached: where the differences of two runs fall.
const BUDGET: usize = 1 << 20;

/// The difference of two runs from which on they follow the same motion, so that roundings grow in them as in the motion.
const RESOLVED: f64 = 1e-4;

/// The seeds of the runs with other roundings: two, since the difference of one may be small by chance.
const SEEDS: [u64; 2] = [0x9e37_79b9_7f4a_7c15, 0x2545_f491_4f6c_dd1d];

/// The distance of two states: the larger of the chart vector `log(g_a^-1 g_b)`, by its norm, and the difference of the
/// spatial momenta relative to their size. NaN if a state is not finite.
pub fn group_distance<G: LieGroup<N>, const N: usize>(a: &GroupState<G, N>, b: &GroupState<G, N>) -> f64 {
    distance_at_size(a, b, 0.0)
}

/// The same for momenta whose size is at least this one.
fn distance_at_size<G: LieGroup<N>, const N: usize>(a: &GroupState<G, N>, b: &GroupState<G, N>, least: f64) -> f64 {
    let turn = G::log(&G::compose(&G::inverse(&a.g), &b.g)).norm();
    let (p, q) = (a.spatial_momentum(), b.spatial_momentum());
    let size = max_or_nan(least, max_or_nan(p.norm(), q.norm()));
    let momentum = if size > 0.0 { (p - q).norm() / size } else { (p - q).norm() };
    max_or_nan(turn, momentum)
}

/// The largest distance, from the end of a run, of the ends of runs with other roundings.
fn growth_of_roundings<G: LieGroup<N>, const N: usize>(
    start: &GroupMotion<G, N>,
    method: &impl GroupIntegrator<G, N>,
    steps: usize,
    end: &GroupState<G, N>,
) -> Result<f64, GroupError> {
    let mut largest = 0.0;
    for mut random in SEEDS {
        let mut motion = start.clone();
        for _ in 0..steps {
            motion.round_otherwise(&mut random);
            motion.advance(method, 1)?;
        }
        // A torque may bring the body to rest, where the momentum is the roundings of the one before.
        let before = start.spatial_momentum().norm() * (motion.log_factor() - start.log_factor()).exp();
        largest = max_or_nan(largest, distance_at_size(end, &motion.state(), before));
    }
    Ok(largest)
}

/// The steps with which a motion over `span` reaches an accuracy at its end: their number is doubled from `steps` until
/// two runs differ by at most `accuracy`, and by at most half as much as the two runs before: steps that are too long for
/// the motion may agree by chance. A step that fails is divided like one that is not accurate.
///
/// All runs have the roundings of the start in common, and near a separatrix these grow: two runs may agree on a wrong end.
/// Where the runs first resolve the motion, two more with other roundings show their growth, and the accuracy is refused
/// if it is smaller.
///
/// The runs may take 2^20 steps together, and more where their differences fall such that they are expected to reach the
/// accuracy with at most 2^24.
///
/// # Errors
/// [`GroupError::Accuracy`] where it is below the roundings of the runs as they grow to the end; [`GroupError::Budget`] where
/// it takes too many steps; the last error of a step where no run succeeds; [`GroupError::Interrupted`] of a step.
pub fn group_steps<G: LieGroup<N>, I: GroupIntegrator<G, N>, const N: usize>(
    start: &GroupMotion<G, N>,
    span: f64,
    accuracy: f64,
    steps: usize,
    integrator: impl Fn(f64) -> Result<I, GroupError>,
) -> Result<GroupSteps, GroupError> {
    if !(accuracy > 0.0 && accuracy.is_finite()) {
        return Err(GroupError::Accuracy { requested: accuracy, reached: f64::NAN, steps: 0 });
    }
    let mut last: Result<GroupState<G, N>, GroupError> = Err(GroupError::Step { h: span });
    // The difference before is not a number for the first two runs, and after one that failed.
    let (mut smallest, mut stagnant, mut best, mut before) = (f64::INFINITY, 0, 0, f64::NAN);
    let (mut count, mut spent) = (steps.max(1), 0usize);
    // The distance at the end that is due to roundings, where it is known.
    let mut growth = None;
    // Whether the accuracy is expected to be reached.
    let mut promising = false;
    while count <= MAX_STEPS && (promising || spent + count <= BUDGET) {
        let h = span / count as f64;
        let method = integrator(h)?;
        let mut motion = start.clone();
        let end = motion.advance(&method, count).map(|()| motion.state());
        if let Err(GroupError::Interrupted) = end {
            return Err(GroupError::Interrupted);
        }
        spent += count;
        promising = false;
        match (&last, &end) {
            (Ok(coarse), Ok(fine)) => {
                // Two runs may agree in all digits, but their round-off is not 0.
                let error = max_or_nan(group_distance(coarse, fine), f64::EPSILON);
                let last_difference = before;
                let falls = error <= 0.5 * before || max_or_nan(error, before) <= 0.01 * accuracy;
                if growth.is_none() && falls && error <= max_or_nan(RESOLVED, accuracy) {
                    let found = growth_of_roundings(start, &integrator(2.0 * h)?, count / 2, coarse)?;
                    if found > accuracy || found.is_nan() {
                        return Err(GroupError::Accuracy { requested: accuracy, reached: found, steps: count / 2 });
                    }
                    spent += count;
                    growth = Some(found);
                }
                // The number of doublings after which the differences, which fall by this factor, are small enough.
                let doublings = ((error / accuracy).ln() / (before / error).ln()).ceil();
                promising = error <= 0.5 * before && count as f64 * doublings.exp2() <= MAX_STEPS as f64;
                before = error;
                // Where the differences have stopped falling, they are round-off that the motion has enlarged, and one of
                // them may be small by chance.
                let certain = stagnant == 0 || max_or_nan(error, last_difference) <= 0.1 * accuracy;
                if error <= accuracy && falls && certain {
                    return Ok(GroupSteps { steps: count, h, error: max_or_nan(error, growth.unwrap_or(0.0)) });
                }
                stagnant = if error < 0.5 * smallest { 0 } else { stagnant + 1 };
                if error < smallest {
                    (smallest, best) = (error, count);
                }
                // At round-off more steps do not help.
                if stagnant >= 3 && smallest < 1e-6 {
                    return Err(GroupError::Accuracy { requested: accuracy, reached: smallest, steps: best });
                }
            }
            _ => before = f64::NAN,
        }
        last = end;
        count = count.saturating_mul(2);
    }
    // Where no run succeeded, a step failed.
    match last {
        Err(error) if smallest == f64::INFINITY => Err(error),
        _ => Err(GroupError::Budget { requested: accuracy, reached: smallest, steps: count / 2 }),
    }
}
