//! The numerical solution for the motion between two points: collocation with both positions given, shooting by
//! Newton's method, and continuation.

use super::conjugate::Fold;
use super::exponential::singular_values;
use super::velocity_seed::seeded;
use crate::numerics::flow::{ACCURACY, Herglotz, Work, integrate};
use crate::numerics::panel::{End, Floor, Problem, Rates, State, collocate};
use crate::{ContactExponential, ExactError, Motion, Retraction, RetractionRoute};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::support::linear::solve;
use contact_geom::{DiscretePoint, Dual, Lagrangian, VelocityPoint, numbers::max_or_nan};
use discrete_herglotz::solve::{ITERATION_LIMIT, last_correction};

/// The accuracy of the first Newton iterations, whose result is only a guess for the last ones: the next
/// correction, which is quadratic, leaves an error of about 1e-12.
const FIRST_ACCURACY: f64 = 1e-6;

/// The [`regularity`] of a shot below which the end points count as conjugate, some units of
/// round-off, to which the derivative is known.
const MIN_REGULARITY: f64 = 64.0 * f64::EPSILON;

/// The same where the derivative is known to [`FIRST_ACCURACY`] only: a hundred times that accuracy, so that at least
/// two digits of the inverse are correct.
const MIN_REGULARITY_AT_FIRST: f64 = 1e-4;

/// Whether a matrix reverses orientation.
pub(super) fn reverses<const N: usize>(mut m: SMatrix<f64, N, N>) -> bool {
    solve(&mut m, &mut SVector::<f64, N>::zeros()).is_ok_and(|determinant| determinant < 0.0)
}

/// The motion with its derivatives with respect to the initial velocity.
type Shot<const N: usize> = Motion<N, Dual<f64, SVector<f64, N>>>;

/// The derivative `dq1/dv0` of a shot.
fn slope<const N: usize>(shot: &Shot<N>) -> SMatrix<f64, N, N> {
    SMatrix::from_fn(|i, j| shot.displacement[i].d[j])
}

/// The [`Fold`] of a shot.
fn fold<const N: usize>(shot: &Shot<N>, time: f64) -> Fold {
    Fold::of(&slope(shot), &SMatrix::from_fn(|i, j| shot.end.v[i].d[j]), time)
}

/// The distance from singularity of the derivative with this inverse, in units of the variation of the end: like the
/// sine of its [`Fold`], but without allocation. For `N = 1` they agree up to a factor of at most `sqrt 2`.
fn regularity<const N: usize>(shot: &Shot<N>, inverse: &SMatrix<f64, N, N>, time: f64) -> f64 {
    let entries = |i: usize, j: usize| max_or_nan(shot.displacement[i].d[j].abs(), (shot.end.v[i].d[j] * time).abs());
    let size = (0..N * N).fold(0.0, |size, k| max_or_nan(size, entries(k / N, k % N)));
    smallest(inverse) / size
}

/// A motion through both points, and the inverse of `dq1/dv0` there.
pub(super) struct Found<const N: usize> {
    pub retraction: Retraction<N>,
    pub inverse: SMatrix<f64, N, N>,
    /// The [distance from singularity](regularity) of the derivative.
    regularity: f64,
}

/// The smallest singular value of a matrix with this inverse, up to a factor of at most `sqrt N`.
pub(super) fn smallest<const N: usize>(inverse: &SMatrix<f64, N, N>) -> f64 {
    1.0 / inverse.norm()
}

impl<L> ContactExponential<L> {
    /// The motion by collocation on one panel with both positions given, from a guess of the initial velocity and of
    /// the inverse of `dq1/dv0`, with the contraction factor of the iteration. `None` unless the iteration contracts
    /// and the error is below round-off.
    pub(super) fn by_collocation<const N: usize>(
        &self,
        t: f64,
        x: &DiscretePoint<N>,
        v0: &mut SVector<f64, N>,
        inverse: &SMatrix<f64, N, N>,
        max_contraction: f64,
    ) -> Result<Option<(Retraction<N>, f64)>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let rates = Herglotz(&self.lagrangian);
        let from = State { q: x.q0, v: *v0, z: x.z0, b: 0.0 };
        let start = rates.at(t, &from)?;
        let end = End { displacement: &(x.q1 - x.q0), inverse, max_contraction };
        let (floor, mut evaluations) = (Floor::default(), 1);
        let problem =
            Problem { t, h: self.h, from: &from, end: Some(end), accuracy: ACCURACY, floor, part: 1.0, narrow: None };
        Ok(match collocate(&rates, &problem, start, v0, &mut evaluations) {
            Ok(panel) if panel.error <= ACCURACY => Some((
                Retraction {
                    start: VelocityPoint { q: x.q0, v: panel.v0, z: x.z0 },
                    end: VelocityPoint { q: x.q1, v: panel.v0 + panel.change.a, z: x.z0 + panel.change.z },
                    action: panel.change.z,
                    b: panel.change.b,
                    // The iteration contracts only before the first conjugate point.
                    conjugate: None,
                    route: RetractionRoute::Collocation,
                    evaluations,
                },
                panel.contraction,
            )),
            _ => None,
        })
    }

    /// The retraction completed by the time by which its motion has met a conjugate point.
    pub(super) fn with_conjugate_time<const N: usize>(
        &self,
        t: f64,
        found: Retraction<N>,
    ) -> Result<Retraction<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        // The resolution at which `Retraction::conjugate` is documented; `conjugate_points` searches more closely.
        const PARTS: u32 = 32;
        let (part, mut at, mut work) = (self.h / f64::from(PARTS), seeded(&found.start), Work::default());
        for k in 0..PARTS {
            at = self.shot(t + f64::from(k) * part, &at, part, FIRST_ACCURACY, &mut work)?.end;
            if reverses(SMatrix::<f64, N, N>::from_fn(|i, j| at.q[i].d[j])) {
                return Ok(Retraction { conjugate: Some(f64::from(k + 1) * part), ..found });
            }
        }
        Ok(Retraction { conjugate: None, ..found })
    }

    /// The motion with its derivatives with respect to the initial velocity, to an accuracy.
    fn shot<const N: usize>(
        &self,
        t: f64,
        start: &VelocityPoint<N, Dual<f64, SVector<f64, N>>>,
        h: f64,
        accuracy: f64,
        work: &mut Work,
    ) -> Result<Shot<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let from = State { q: start.q, v: start.v, z: start.z, b: Dual::constant(0.0) };
        integrate(&Herglotz(&self.lagrangian), t, &from, h, accuracy, work)
    }

    /// The inverse of `dq1/dv0` along the motion from a start, to [`FIRST_ACCURACY`] accuracy; `None` where the
    /// derivative is nearly singular or the motion is not defined.
    pub(super) fn slope_inverse<const N: usize>(
        &self,
        t: f64,
        start: &VelocityPoint<N>,
        work: &mut Work,
    ) -> Option<SMatrix<f64, N, N>>
    where
        L: Lagrangian<N>,
    {
        let shot = self.shot(t, &seeded(start), self.h, FIRST_ACCURACY, work).ok()?;
        slope(&shot).try_inverse().filter(|inverse| regularity(&shot, inverse, self.h) > MIN_REGULARITY_AT_FIRST)
    }

    /// Newton's method on `exp_h`, first to a few digits. Further digits are computed by collocation with the
    /// derivative found, or else by continuing Newton's method.
    pub(super) fn by_newton<const N: usize>(
        &self,
        t: f64,
        x: &DiscretePoint<N>,
        guess: &SVector<f64, N>,
        work: &mut Work,
    ) -> Result<Retraction<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let rough = self.shoot(t, x, guess, (self.h, FIRST_ACCURACY), work)?;
        let near = rough.retraction.start.v;
        let regular = rough.regularity > MIN_REGULARITY_AT_FIRST;
        if regular && let Some((found, _)) = self.by_collocation(t, x, &mut { near }, &rough.inverse, 1.0)? {
            // Accept only the motion that Newton's method has found.
            if (found.start.v - near).amax() <= FIRST_ACCURACY.sqrt() * near.amax() {
                return Ok(Retraction { route: RetractionRoute::Newton, ..found });
            }
        }
        Ok(self.shoot(t, x, &near, (self.h, ACCURACY), work)?.retraction)
    }

    /// Newton's method on `exp_h` with the derivative `dq1/dv0` of the variational equation. A change is halved if the
    /// motion then leaves its domain, or ends more than twice as far from the second point.
    pub(super) fn shoot<const N: usize>(
        &self,
        t: f64,
        x: &DiscretePoint<N>,
        guess: &SVector<f64, N>,
        (h, accuracy): (f64, f64),
        work: &mut Work,
    ) -> Result<Found<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let displacement = x.q1 - x.q0;
        let (mut v, mut change) = (*guess, SVector::<f64, N>::zeros());
        let (mut before, mut nearest) = (f64::INFINITY, f64::INFINITY);
        let mut last = None;
        for _ in 0..ITERATION_LIMIT {
            let start = VelocityPoint { q: x.q0, v, z: x.z0 };
            let shot = match self.shot(t, &seeded(&start), h, accuracy, work) {
                Ok(shot) => shot,
                Err(error) if last.is_none() || work.is_done() => return Err(error),
                Err(_) => {
                    change *= 0.5;
                    v -= change;
                    continue;
                }
            };
            let missed = shot.displacement.map(|d| d.re) - displacement;
            let slope = slope(&shot);
            let residual = missed.amax();
            if residual > 2.0 * nearest && change.amax() > f64::EPSILON * v.amax() {
                change *= 0.5;
                v -= change;
                continue;
            }
            nearest = nearest.min(residual);
            last = Some((start, residual, slope, shot));
            change = -missed;
            let (mut matrix, size) = (slope, v.amax());
            if solve(&mut matrix, &mut change).is_err() {
                break;
            }
            let now = change.amax();
            // The next change is about now^3 / before^2 or, at round-off, too small to change any position.
            let predicted = last_correction(now, before, 2.0 * accuracy * size.max(now));
            let resolution = 2.0 * accuracy * (x.q0.amax().max(x.q1.amax()) / h.abs()).max(size);
            let stagnant = now >= 0.5 * before && now <= 64.0 * resolution;
            if residual == 0.0 || (before.is_finite() && (predicted || stagnant)) {
                let Some(inverse) = slope.try_inverse() else { break };
                let regularity = regularity(&shot, &inverse, h);
                if regularity.is_nan() || regularity <= MIN_REGULARITY {
                    break;
                }
                return Ok(Found { retraction: moved(x, &start, &shot, &change), inverse, regularity });
            }
            v += change;
            before = now;
        }
        let Some((start, residual, slope, shot)) = last else {
            return Err(ExactError::NotConverged {
                last: VelocityPoint { q: x.q0, v: *guess, z: x.z0 },
                residual: f64::INFINITY,
                smallest: 0.0,
            });
        };
        let (smallest, fold) = (singular_values(&slope).smallest, fold(&shot, h));
        // Newton's method is slow, and its limit ill determined, where the derivative nearly vanishes.
        Err(if fold.sine <= f64::EPSILON.sqrt() && !fold.decayed {
            ExactError::ConjugatePoint { last: start, residual, smallest }
        } else {
            ExactError::NotConverged { last: start, residual, smallest }
        })
    }

    /// Continuation: the motions in the times `s h` to the points `q0 + s (q1 - q0)`, for s increasing to 1, where each
    /// is the guess for the next.
    pub(super) fn by_continuation<const N: usize>(
        &self,
        t: f64,
        x: &DiscretePoint<N>,
        work: &mut Work,
    ) -> Option<Found<N>>
    where
        L: Lagrangian<N>,
    {
        let (mut s, mut step) = (0.0, 0.125);
        let mut v = (x.q1 - x.q0) / self.h;
        while step > 1e-3 && !work.is_done() {
            let next = f64::min(s + step, 1.0);
            let target = DiscretePoint { q1: x.q0 + (x.q1 - x.q0) * next, ..*x };
            let accuracy = if next < 1.0 { FIRST_ACCURACY } else { ACCURACY };
            match self.shoot(t, &target, &v, (next * self.h, accuracy), work) {
                Ok(found) if next == 1.0 => return Some(found),
                Ok(found) => {
                    v = found.retraction.start.v;
                    s = next;
                    step *= 1.5;
                }
                Err(_) => step *= 0.5,
            }
        }
        None
    }
}

/// The motion after the last small change of its initial velocity, to first order in the change, which makes another
/// integration unnecessary.
fn moved<const N: usize>(
    x: &DiscretePoint<N>,
    start: &VelocityPoint<N>,
    shot: &Shot<N>,
    change: &SVector<f64, N>,
) -> Retraction<N> {
    let along = |c: &Dual<f64, SVector<f64, N>>| c.re + c.d.dot(change);
    Retraction {
        start: VelocityPoint { v: start.v + change, ..*start },
        end: VelocityPoint { q: x.q1, v: SVector::from_fn(|i, _| along(&shot.end.v[i])), z: along(&shot.end.z) },
        action: along(&shot.action),
        b: along(&shot.b),
        conjugate: None,
        route: RetractionRoute::Newton,
        evaluations: shot.evaluations,
    }
}
