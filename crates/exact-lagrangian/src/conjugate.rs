//! Conjugate points: where the exponential map stops being a local diffeomorphism.

use crate::exact_lagrangian::seeded;
use crate::{ContactExponential, ExactError, herglotz_flow};
use contact_geom::nalgebra::{DMatrix, SMatrix};
use contact_geom::{Lagrangian, Regularity, VelocityPoint};

/// A time at which a motion meets a conjugate point: motions with slightly different initial velocities meet there again, to
/// first order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConjugatePoint {
    /// The time, counted from the motion's start.
    pub after: f64,
    /// The smallest singular value of `dq1/dv0` there, in units of the largest met until then: how nearly it vanishes.
    pub smallest: f64,
}

/// The samples of a motion between which conjugate points are looked for.
const SAMPLES: usize = 128;

impl<L> ContactExponential<L> {
    /// The conjugate points along the motion from a start at time t, up to the time h, in their order.
    ///
    /// `dq(s)/dv0` is followed at 128 equidistant times s; a change of sign of its determinant, or a minimum of its smallest
    /// singular value that goes to zero (a conjugate point of even multiplicity), is located to round-off. Two conjugate points
    /// within one interval are missed.
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
        let slope_after = |s: f64| -> Result<SMatrix<f64, N, N>, ExactError<N>> {
            let motion = herglotz_flow(&self.lagrangian, t, &seeded(x), s)?;
            Ok(SMatrix::from_fn(|i, j| motion.displacement[i].d[j]))
        };
        let of = |m: &SMatrix<f64, N, N>| {
            let m = DMatrix::from_fn(N, N, |i, j| m[(i, j)]);
            (m.determinant(), Regularity::of(m))
        };
        let determinant_after = |s: f64| -> Result<f64, ExactError<N>> { Ok(of(&slope_after(s)?).0) };
        let smallest_after = |s: f64| -> Result<f64, ExactError<N>> { Ok(of(&slope_after(s)?).1.smallest) };
        let mut samples = Vec::with_capacity(SAMPLES);
        let (mut motion_start, mut done) = (seeded(x), 0.0);
        for k in 1..=SAMPLES {
            let s = self.h * k as f64 / SAMPLES as f64;
            let motion = herglotz_flow(&self.lagrangian, t + done, &motion_start, s - done)?;
            (motion_start, done) = (motion.end, s);
            let slope = SMatrix::<f64, N, N>::from_fn(|i, j| motion.end.q[i].d[j]);
            let (determinant, values) = of(&slope);
            samples.push((s, determinant, values));
        }
        let mut found = Vec::new();
        let mut largest: f64 = 0.0;
        for k in 0..SAMPLES {
            let (s, determinant, values) = samples[k];
            largest = largest.max(values.largest);
            let Some((before, earlier, _)) = k.checked_sub(1).map(|j| samples[j]) else { continue };
            if determinant == 0.0 || earlier * determinant < 0.0 {
                let after = bisect(before, s, determinant_after)?;
                found.push(ConjugatePoint { after, smallest: smallest_after(after)? / largest });
                continue;
            }
            // A minimum in the interior without a change of sign.
            let Some(next) = samples.get(k + 1) else { continue };
            let around = (samples[k - 1].2.smallest, values.smallest, next.2.smallest);
            if around.1 < around.0 && around.1 <= around.2 && determinant * next.1 > 0.0 {
                let (after, smallest) = lowest(before, next.0, smallest_after)?;
                if smallest <= f64::EPSILON.sqrt() * largest {
                    found.push(ConjugatePoint { after, smallest: smallest / largest });
                }
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

/// The lowest point of a function with a minimum between two points, by golden section.
fn lowest<E>(mut low: f64, mut high: f64, f: impl Fn(f64) -> Result<f64, E>) -> Result<(f64, f64), E> {
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
