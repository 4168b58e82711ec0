//! The reference motion, in pieces so short that no narrow term is passed over.

use super::random_numbers::RandomNumbers;
use super::system::RandomSystem;
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, PhasePoint, VelocityPoint, legendre, numbers::max_or_nan};
use exact_lagrangian::{ExactError, herglotz_flow};

/// The largest number of pieces of a reference.
const PIECES: usize = 2000;

/// The largest number of evaluations of the vector field for a reference, about half a second.
const WORK: u64 = 1_000_000;

/// A motion with its end, its size and its condition.
pub struct Truth<const N: usize> {
    pub end: PhasePoint<N>,
    /// The largest position, momentum and action along the motion.
    pub size: [f64; 3],
    /// The growth up to the end of a small relative change of the start, and of rounding along the motion.
    pub condition: f64,
}

/// Why there is no reference.
pub enum NoTruth {
    /// The motion is defined until this time alone.
    Ends(f64),
    /// It needs too many pieces, or overflows.
    TooLong,
}

impl<const N: usize> Truth<N> {
    /// The distance of a state from the end: the largest of position, momentum and (where given) action, each relative
    /// to its size along the motion.
    pub fn error(&self, q: &SVector<f64, N>, p: &SVector<f64, N>, z: Option<f64>) -> f64 {
        let [size_q, size_p, size_z] = self.size;
        let (dq, dp) = (max_abs_or_nan(&(q - self.end.q)), max_abs_or_nan(&(p - self.end.p)));
        let dz = z.map_or(0.0, |z| (z - self.end.z).abs());
        max_or_nan(max_or_nan(relative(dq, size_q), relative(dp, size_p)), relative(dz, size_z))
    }

    /// The error from rounding in a number of steps: some hundred units a step, which grow with the motion and add up
    /// like a random walk; and the rounding of the time, whose spacing is that of `t0`, for forces with frequencies up
    /// to 20.
    pub fn rounding(&self, t0: f64, steps: usize) -> f64 {
        f64::EPSILON * self.condition * (1e3 * (steps as f64).sqrt() + 1e3 * t0.abs())
    }

    /// The error of `(q, p)` relative to its size at the end, which `Run::accuracy` bounds.
    pub fn error_at_end(&self, q: &SVector<f64, N>, p: &SVector<f64, N>) -> f64 {
        let norm = |q: &SVector<f64, N>, p: &SVector<f64, N>| max_or_nan(max_abs_or_nan(q), max_abs_or_nan(p));
        relative(norm(&(q - self.end.q), &(p - self.end.p)), norm(&self.end.q, &self.end.p))
    }
}

/// A difference of zero is zero relative to a size of zero too: a motion may rest at the origin.
fn relative(difference: f64, size: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference / size }
}

fn max_abs_or_nan<const N: usize>(x: &SVector<f64, N>) -> f64 {
    contact_geom::numbers::max_abs_or_nan(x.iter().copied())
}

/// The end of a motion, computed in pieces, and its largest position, momentum and action.
fn pieces<const N: usize>(
    system: &RandomSystem<N>,
    t0: f64,
    start: &VelocityPoint<N>,
    span: f64,
) -> Result<(VelocityPoint<N>, [f64; 3]), NoTruth> {
    let (mut x, mut done, mut size, mut work) = (*start, 0.0, [0.0; 3], 0);
    for _ in 0..PIECES {
        let at = legendre(system, t0 + done, &x);
        for (size, now) in size.iter_mut().zip([max_abs_or_nan(&at.q), max_abs_or_nan(&at.p), at.z.abs()]) {
            *size = max_or_nan(*size, now);
        }
        if done == span {
            return if size.iter().all(|s| s.is_finite()) { Ok((x, size)) } else { Err(NoTruth::TooLong) };
        }
        let piece = system.bump_time(&x).min(span / 4.0);
        let (next, piece) = if done + piece >= span { (span, span - done) } else { (done + piece, piece) };
        if next == done || work > WORK {
            return Err(NoTruth::TooLong);
        }
        match herglotz_flow(system, t0 + done, &x, piece) {
            Ok(motion) => (x, done, work) = (motion.end, next, work + motion.evaluations),
            Err(ExactError::OutsideDomain { t, .. }) => return Err(NoTruth::Ends(t)),
            Err(_) => return Err(NoTruth::TooLong),
        }
    }
    Err(NoTruth::TooLong)
}

/// The motion from a start.
pub fn truth<const N: usize>(
    system: &RandomSystem<N>,
    t0: f64,
    start: &VelocityPoint<N>,
    span: f64,
) -> Result<Truth<N>, NoTruth> {
    let (end, size) = pieces(system, t0, start, span)?;
    let end = legendre(system, t0 + span, &end);
    let mut truth = Truth { end, size, condition: 1.0 };
    // A second start, at a relative distance of 1e-8 in each coordinate and of the size along the motion.
    const ASIDE: f64 = 1e-8;
    let mut random = RandomNumbers::of(1);
    let from = ChartVector::from(*start);
    let beside = ChartVector::from_fn(|i| {
        let reach = if i < N { size[0] } else { 0.0 };
        from.component(i) + ASIDE * random.between(0.5, 1.0) * max_or_nan(from.component(i).abs(), reach)
    });
    if let Ok((end, _)) = pieces(system, t0, &beside.into(), span) {
        let end = legendre(system, t0 + span, &end);
        truth.condition = max_or_nan(1.0, truth.error(&end.q, &end.p, Some(end.z)) / ASIDE);
        truth.condition = max_or_nan(truth.condition, truth.error_at_end(&end.q, &end.p) / ASIDE);
    } else {
        truth.condition = f64::INFINITY;
    }
    Ok(truth)
}
