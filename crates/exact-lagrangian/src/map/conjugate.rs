//! Conjugate points, at which the exponential map is not a local diffeomorphism.

use crate::map::velocity_seed::seeded;
use crate::{ContactExponential, ExactError, herglotz_flow};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::{Dual, Lagrangian, Regularity, VelocityPoint, numbers::max_abs_or_nan};

/// A time at which a motion meets a conjugate point: motions with slightly different initial velocities meet there
/// again, to first order.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct ConjugatePoint {
    /// The time since the start of the motion.
    pub after: f64,
    /// A measure of how close to singular `dq1/dv0` is there: the smallest ratio, over all variations of the initial
    /// velocity, of the change of position to the change of position and velocity (times the time). A motion that has
    /// merely decayed therefore has no conjugate point.
    pub smallest: f64,
}

/// The number of samples of a motion between which conjugate points are searched: four times as many as for
/// [`Retraction::conjugate`](crate::Retraction::conjugate).
const SAMPLES: usize = 128;

/// The variation of the end of a motion with its initial velocity, as needed to detect a fold of the exponential map.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fold {
    /// The sign of `det dq1/dv0`.
    pub sign: f64,
    /// The smallest of `|dq1| / |(dq1, t dv1)|` over all directions of dv0. It is zero at a conjugate point, where a
    /// variation of the initial velocity changes only the final velocity.
    pub sine: f64,
    /// Whether a variation has left the range of normal numbers, usually by decay, so that no conjugate point can be
    /// detected.
    pub decayed: bool,
}

impl Fold {
    /// Computes it from the variations of the end after a time; `dq` and `dv` have one column for each direction of
    /// dv0.
    pub fn of<const N: usize>(dq: &SMatrix<f64, N, N>, dv: &SMatrix<f64, N, N>, time: f64) -> Self {
        let entry = |i: usize, j: usize| if i < N { dq[(i, j)] } else { dv[(i - N, j)] * time };
        let columns = DMatrix::from_fn(2 * N, N, entry);
        // Scale each variation to unit size.
        let sizes: Vec<f64> = columns.column_iter().map(|c| max_abs_or_nan(c.iter().copied())).collect();
        if sizes.iter().any(|s| !(*s > f64::MIN_POSITIVE / f64::EPSILON && s.is_finite())) {
            return Fold { sign: 0.0, sine: 0.0, decayed: true };
        }
        let scaled = DMatrix::from_fn(2 * N, N, |i, j| columns[(i, j)] / sizes[j]);
        let sign = scaled.rows(0, N).clone_owned().determinant().signum();
        let sine = Regularity::of(scaled.qr().q().rows(0, N).into_owned()).smallest;
        Fold { sign, sine, decayed: false }
    }
}

impl<L> ContactExponential<L> {
    /// The conjugate points along the motion from a start at time t, up to the time h, in ascending order.
    ///
    /// `dq(s)/dv0` is computed at 128 equidistant times s. A change of sign of its determinant, or a minimum of its
    /// smallest relative value at zero (a conjugate point of even multiplicity), is located to round-off. Two conjugate
    /// points within one interval are missed. The search ends where the variations have decayed below the smallest
    /// normal number.
    ///
    /// # Errors
    /// Those of [`herglotz_flow`] up to h.
    pub fn conjugate_points<const N: usize>(
        &self,
        t: f64,
        x: &VelocityPoint<N>,
    ) -> Result<Vec<ConjugatePoint>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let fold = |end: &VelocityPoint<N, Dual<f64, SVector<f64, N>>>, s: f64| {
            let [dq, dv] = [&end.q, &end.v].map(|of| SMatrix::<f64, N, N>::from_fn(|i, j| of[i].d[j]));
            Fold::of(&dq, &dv, s)
        };
        let fold_after = |s: f64| -> Result<Fold, ExactError<N>> {
            Ok(fold(&herglotz_flow(&self.lagrangian, t, &seeded(x), s)?.end, s))
        };
        let mut samples = Vec::with_capacity(SAMPLES);
        let (mut start, mut done) = (seeded(x), 0.0);
        for k in 1..=SAMPLES {
            let s = self.h * k as f64 / SAMPLES as f64;
            start = herglotz_flow(&self.lagrangian, t + done, &start, s - done)?.end;
            done = s;
            let fold = fold(&start, s);
            if fold.decayed {
                break;
            }
            samples.push((s, fold));
        }
        let mut found = Vec::new();
        let mut add = |after: f64, sine: f64| {
            if sine <= f64::EPSILON.sqrt() {
                found.push(ConjugatePoint { after, smallest: sine });
            }
        };
        for (k, pair) in samples.windows(2).enumerate() {
            let [(before, earlier), (s, fold)] = [pair[0], pair[1]];
            if fold.sign != earlier.sign {
                let after = bisect(before, s, |s| Ok::<_, ExactError<N>>(fold_after(s)?.sign))?;
                add(after, fold_after(after)?.sine);
                continue;
            }
            // A minimum in the interior without a change of sign.
            let Some((after, next)) = samples.get(k + 2) else { continue };
            if fold.sine < earlier.sine && fold.sine <= next.sine && fold.sign == next.sign {
                let (after, sine) = lowest(before, *after, |s| Ok::<_, ExactError<N>>(fold_after(s)?.sine))?;
                add(after, sine);
            }
        }
        Ok(found)
    }
}

/// The zero of a function that changes its sign between two points, by bisection to round-off.
fn bisect<E>(mut low: f64, mut high: f64, f: impl Fn(f64) -> Result<f64, E>) -> Result<f64, E> {
    let sign = f(low)?.signum();
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return Ok(high);
        }
        if f(middle)?.signum() == sign { low = middle } else { high = middle }
    }
}

/// The minimum of a function between two points, by golden section search.
fn lowest<E>(mut low: f64, mut high: f64, f: impl Fn(f64) -> Result<f64, E>) -> Result<(f64, f64), E> {
    // The golden ratio minus one: each evaluation reduces the interval by this factor.
    let golden = 0.618_033_988_749_894_9;
    let (mut a, mut b) = (high - golden * (high - low), low + golden * (high - low));
    let (mut at_a, mut at_b) = (f(a)?, f(b)?);
    while high - low > 4.0 * f64::EPSILON * high {
        if at_a < at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - golden * (high - low);
            at_a = f(a)?;
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + golden * (high - low);
            at_b = f(b)?;
        }
        if b <= a {
            break;
        }
    }
    Ok(if at_a < at_b { (a, at_a) } else { (b, at_b) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_examples::systems::HarmonicOscillator;

    /// A derivative that has merely decayed is not reported as a conjugate point. The conjugate points of a decaying
    /// oscillation are found as long as its amplitude is a normal number.
    #[test]
    fn decay_is_no_fold() {
        let x = VelocityPoint::new([0.0], [1.2], 0.0);
        // Decay by e^-30 and more, and below the smallest number.
        for (gamma, h) in [(-3.0, 60.0), (-3.0, 4000.0), (-1.0, 60.0), (-1.9, 60.0)] {
            let exp = ContactExponential::new(HarmonicOscillator { gamma }, h).unwrap();
            let found = exp.conjugate_points(0.0, &x).unwrap();
            let w = (1.0 - gamma * gamma / 4.0f64).sqrt();
            for (k, point) in found.iter().enumerate() {
                let truth = (k + 1) as f64 * std::f64::consts::PI / w;
                assert!((point.after - truth).abs() < 1e-11 * truth, "{gamma}: {point:?}");
            }
            let count = if gamma > -2.0 { (h * w / std::f64::consts::PI) as usize } else { 0 };
            assert_eq!(found.len(), count, "{gamma}");
        }
        // For a start at the origin, the end determines the velocity however small it is.
        for (gamma, h) in [(-0.5, 100.0), (-1.0, 71.0), (-3.0, 60.0)] {
            let exp = ContactExponential::new(HarmonicOscillator { gamma }, h).unwrap();
            let y = exp.at(0.0, &x).unwrap();
            let back = exp.retract(0.0, &y);
            assert!(!matches!(back, Err(ExactError::ConjugatePoint { .. })), "{gamma}: {back:?}");
            assert!(back.is_ok_and(|b| (b.start.v[0] - 1.2).abs() < 1e-10), "{gamma}: {back:?}");
        }
    }
}
