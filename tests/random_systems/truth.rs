//! The motion itself, in pieces so short that nothing hidden is passed over.

use super::dice::Dice;
use super::system::RandomSystem;
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, PhasePoint, VelocityPoint, legendre, max_or_nan};
use exact_lagrangian::{ExactError, herglotz_flow};

/// The pieces that a reference may take: what needs more is left alone.
const PIECES: usize = 2000;

/// The evaluations of the vector field that a reference may take in all, about half a second's.
const WORK: u64 = 1_000_000;

/// A motion with its end, its size and its condition.
pub struct Truth<const N: usize> {
    pub end: PhasePoint<N>,
    /// The largest position, momentum and action on the way.
    pub size: [f64; 3],
    /// How much a small relative change of the start, and what rounding does on the way, has grown at the end.
    pub condition: f64,
}

/// Why there is no reference.
pub enum NoTruth {
    /// The motion is not defined up to the end: until this time.
    Ends(f64),
    /// It needs more pieces than a test has time for, or grows beyond all numbers.
    TooLong,
}

impl<const N: usize> Truth<N> {
    /// The distance of a state from the end: the largest of position, momentum and (where it is there) action, each relative
    /// to its size on the way.
    pub fn error(&self, q: &SVector<f64, N>, p: &SVector<f64, N>, z: Option<f64>) -> f64 {
        let [size_q, size_p, size_z] = self.size;
        let (dq, dp) = (max_abs_or_nan(&(q - self.end.q)), max_abs_or_nan(&(p - self.end.p)));
        let dz = z.map_or(0.0, |z| (z - self.end.z).abs());
        max_or_nan(max_or_nan(relative(dq, size_q), relative(dp, size_p)), relative(dz, size_z))
    }

    /// The error that rounding may make in some steps: to some hundred units a step, which grow as the motion lets them and add
    /// up like a random walk; and that of the time, whose spacing is that of `t0`, in which a force has frequencies to 20.
    pub fn rounding(&self, t0: f64, steps: usize) -> f64 {
        f64::EPSILON * self.condition * (1e3 * (steps as f64).sqrt() + 1e3 * t0.abs())
    }

    /// The error of `(q, p)` relative to its size at the end, as `Run::accuracy` promises it.
    pub fn error_at_end(&self, q: &SVector<f64, N>, p: &SVector<f64, N>) -> f64 {
        let norm = |q: &SVector<f64, N>, p: &SVector<f64, N>| max_or_nan(max_abs_or_nan(q), max_abs_or_nan(p));
        relative(norm(&(q - self.end.q), &(p - self.end.p)), norm(&self.end.q, &self.end.p))
    }
}

/// No difference is none of a size of nothing either: a motion may rest at the origin.
fn relative(difference: f64, size: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference / size }
}

fn max_abs_or_nan<const N: usize>(x: &SVector<f64, N>) -> f64 {
    contact_geom::max_abs_or_nan(x.iter().copied())
}

/// The end of a motion, piece by piece, and its largest position, momentum and action.
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
        let piece = system.patience(&x).min(span / 4.0);
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
    // A start beside it, by a part in 1e8 of each coordinate and of the size on the way.
    const ASIDE: f64 = 1e-8;
    let mut dice = Dice::of(1);
    let from = ChartVector::from(*start);
    let beside = ChartVector::from_fn(|i| {
        let reach = if i < N { size[0] } else { 0.0 };
        from.component(i) + ASIDE * dice.between(0.5, 1.0) * max_or_nan(from.component(i).abs(), reach)
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
