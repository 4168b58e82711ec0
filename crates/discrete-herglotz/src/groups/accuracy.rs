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
    /// The difference at the end from a run with half as many steps, by [`group_distance`]: a bound of the error, which
    /// is smaller by about `2^order - 1`. Where round-off is of the size of the accuracy, the largest difference of three
    /// runs, or that from runs with other roundings, if it is larger.
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
/// Where the differences do not fall any more, what is left of them is round-off, and three runs, each with twice as many
/// steps as the one before, must differ by at most `accuracy`.
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
    let (mut smallest, mut stagnant, mut before) = (f64::INFINITY, 0, f64::NAN);
    // The steps for which three runs in a row differ least: two may agree by chance.
    let mut best = GroupSteps { steps: 0, h: span, error: f64::INFINITY };
    let (mut count, mut spent) = (steps.max(1), 0usize);
    // The distance at the end that is due to roundings, where it is known.
    let mut growth = None;
    // Whether the accuracy is expected to be reached.
    let (mut promising, mut is_round_off) = (false, false);
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
                let of_three = max_or_nan(error, before);
                let falls = error <= 0.5 * before || of_three <= 0.01 * accuracy;
                let resolves = (falls || of_three <= accuracy) && error <= max_or_nan(RESOLVED, accuracy);
                if growth.is_none() && resolves {
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
                if of_three < best.error {
                    best = GroupSteps { steps: count, h, error: of_three };
                }
                before = error;
                // Where the differences have stopped falling, they are round-off that the motion has enlarged, and one of
                // them may be small by chance.
                let certain = stagnant == 0 || of_three <= 0.1 * accuracy;
                if error <= accuracy && falls && certain {
                    return Ok(GroupSteps { steps: count, h, error: max_or_nan(error, growth.unwrap_or(0.0)) });
                }
                stagnant = if error < 0.5 * smallest { 0 } else { stagnant + 1 };
                smallest = if error < smallest { error } else { smallest };
                // At round-off more steps do not help.
                if stagnant >= 3 && smallest < 1e-6 {
                    is_round_off = true;
                    break;
                }
            }
            _ => before = f64::NAN,
        }
        last = end;
        count = count.saturating_mul(2);
    }
    let reached = best.error;
    match last {
        // Where no run succeeded, a step failed.
        Err(error) if smallest == f64::INFINITY => Err(error),
        _ if reached <= accuracy => Ok(GroupSteps { error: max_or_nan(reached, growth.unwrap_or(0.0)), ..best }),
        _ if is_round_off => Err(GroupError::Accuracy { requested: accuracy, reached, steps: best.steps }),
        _ => Err(GroupError::Budget { requested: accuracy, reached, steps: count / 2 }),
    }
}
