//! The exact retractions: the motion from one point to another.

use crate::conjugate::Fold;
use crate::exact_lagrangian::seeded;
use crate::exponential::singular_values;
use crate::flow::{ACCURACY, Herglotz, Work, integrate};
use crate::panel::{End, Floor, Problem, Rates, State, collocate};
use crate::{ContactExponential, ExactError, Motion, herglotz_flow};
use contact_geom::linear::solve;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{DiscretePoint, Dual, Lagrangian, Scalar, VelocityPoint, larger};
use discrete_herglotz::{InputError, last_correction};

/// The Newton iterations that a retraction may take.
pub(crate) const ITERATIONS: u32 = 50;

/// The accuracy of the first Newton iterations: of what is only a guess for the last.
const ROUGH: f64 = 1e-6;

/// The sine of a [`Fold`] below which the end points count as conjugate.
const CONJUGATE: f64 = 64.0 * f64::EPSILON;

/// The same where the slope is known to [`ROUGH`] accuracy only.
const NEARLY: f64 = 1e-4;

/// The contraction below which a conjugate point is far: the slowest mode of the iteration with both ends given contracts by 1 at
/// a conjugate point, the next by 1/4 there.
const SAFE: f64 = 0.1;

/// The contraction above which the slope is worth its cost.
const PATIENCE: f64 = 0.3;

/// The contraction that an iteration with the slope must have: it shows that the slope is that of this motion.
const SLOPED: f64 = 0.8;

/// Whether a matrix reverses orientation.
fn reverses<const N: usize>(mut m: SMatrix<f64, N, N>) -> bool {
    solve(&mut m, &mut SVector::<f64, N>::zeros()).is_ok_and(|determinant| determinant < 0.0)
}

/// How the motion between two points was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RetractionRoute {
    /// By collocation with both positions given: the shortest way, taken where its iteration contracts.
    Collocation,
    /// By Newton's method on the exponential map.
    Newton,
    /// By Newton's method, led from a short time to h along the straight line between the points.
    Continuation,
}

/// The motion from `q0` to `q1` in time h: `R_h^(e-)` is its start, `R_h^(e+) = phi_h o R_h^(e-)` its end; paper, section 4.1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Retraction<const N: usize> {
    /// `R_h^(e-)(q0, q1, z0) = (q0, v0, z0)`.
    pub start: VelocityPoint<N>,
    /// `R_h^(e+)(q0, q1, z0) = (q1, v1, z1)`.
    pub end: VelocityPoint<N>,
    /// The action `z1 - z0`, to round-off of itself: the value of `L_h^e`.
    pub action: f64,
    /// `b = int L_z dt` along the motion.
    pub b: f64,
    /// The time from the start, to a part in 32 of h, by which the motion has met a conjugate point: then other motions join the
    /// points as well, and this is one of several. `None` if it meets none by the sign of `det dq(t)/dv0`, which on the quick route
    /// is looked at in the end only; [`conjugate_points`](ContactExponential::conjugate_points) looks more closely, also for those
    /// of even multiplicity.
    pub conjugate: Option<f64>,
    /// How it was found.
    pub route: RetractionRoute,
    /// The evaluations of the vector field that the last pass took.
    pub evaluations: u64,
}

/// The motion with its derivatives in the initial velocity.
type Shot<const N: usize> = Motion<N, Dual<f64, SVector<f64, N>>>;

/// The derivative `dq1/dv0` of a shot.
fn slope<const N: usize>(shot: &Shot<N>) -> SMatrix<f64, N, N> {
    SMatrix::from_fn(|i, j| shot.displacement[i].d[j])
}

/// What a shot makes of variations of its initial velocity.
fn fold<const N: usize>(shot: &Shot<N>, time: f64) -> Fold {
    Fold::of(&slope(shot), &SMatrix::from_fn(|i, j| shot.end.v[i].d[j]), time)
}

/// How far from singular the slope is that has this inverse, in units of what the motion makes of velocities: like the sine of its
/// [`Fold`], without allocation and exactly that for `N = 1`.
fn regularity<const N: usize>(shot: &Shot<N>, inverse: &SMatrix<f64, N, N>, time: f64) -> f64 {
    let entries = |i: usize, j: usize| larger(shot.displacement[i].d[j].abs(), (shot.end.v[i].d[j] * time).abs());
    let size = (0..N * N).fold(0.0, |size, k| larger(size, entries(k / N, k % N)));
    smallest(inverse) / size
}

/// A motion through both points, and the inverse of `dq1/dv0` there.
struct Found<const N: usize> {
    retraction: Retraction<N>,
    inverse: SMatrix<f64, N, N>,
    /// [How far from singular](regularity) the slope is.
    regularity: f64,
}

/// The smallest singular value of a matrix with this inverse, up to a factor of at most `sqrt N`.
fn smallest<const N: usize>(inverse: &SMatrix<f64, N, N>) -> f64 {
    1.0 / inverse.norm()
}

impl<L> ContactExponential<L> {
    /// The retraction of two points at time t.
    ///
    /// Where several motions join the points in time h this is as a rule the one that the motions of shorter times between points on
    /// the straight line lead to; [`retract_near`](Self::retract_near) finds others, and
    /// [`conjugate_points`](Self::conjugate_points) tells whether there may be some: before the first conjugate point the
    /// motion is locally the only one.
    ///
    /// First by collocation with both positions given, which costs no more than the motion itself; then by Newton's method on
    /// `exp_h`, from `(q1 - q0)/h`, and by continuation in h.
    ///
    /// # Errors
    /// [`ExactError::Input`] for a non-finite point, a singular W, or (where there is no unique motion)
    /// [`InputError::EqualPoints`]; [`ExactError::NotConverged`], [`ExactError::ConjugatePoint`],
    /// [`ExactError::OutsideDomain`] with the last motion tried.
    pub fn retract<const N: usize>(&self, t: f64, x: &DiscretePoint<N>) -> Result<Retraction<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let found = self.between(t, x)?;
        if found.route == RetractionRoute::Collocation && found.conjugate.is_none() {
            Ok(found)
        } else {
            self.marked(t, found)
        }
    }

    /// The retraction of two points without a search for the first conjugate point, which a jet does not need: `conjugate` is the
    /// whole time where `dq1/dv0` is seen to reverse orientation.
    pub(crate) fn between<const N: usize>(&self, t: f64, x: &DiscretePoint<N>) -> Result<Retraction<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        x.check()?;
        let mut work = Work::default();
        let guess = (x.q1 - x.q0) / self.h;
        let (free, mut v0) = (SMatrix::from_diagonal_element(1.0 / self.h), guess);
        let quick = self.by_collocation(t, x, &mut v0, &free, PATIENCE)?;
        if let Some((found, contraction)) = quick
            && contraction < SAFE
        {
            return Ok(found);
        }
        // Slow, or perhaps near a conjugate point, where all modes but one contract and that one may be absent: ask the slope, and
        // where the iteration was given up go on with it.
        if let Some(inverse) = self.slope_inverse(t, &VelocityPoint { q: x.q0, v: v0, z: x.z0 }, &mut work) {
            let found = match quick {
                Some(found) => Some(found),
                None => self.by_collocation(t, x, &mut v0, &inverse, SLOPED)?,
            };
            if let Some((found, _)) = found {
                return Ok(Retraction { conjugate: reverses(inverse).then_some(self.h), ..found });
            }
        }
        let failed = match self.by_newton(t, x, &guess, &mut work) {
            Ok(found) => return Ok(found),
            Err(failed) => failed,
        };
        match self.lead(t, x, &mut work) {
            Some(found) => Ok(Retraction { route: RetractionRoute::Continuation, ..found.retraction }),
            None if x.q0 == x.q1 => Err(InputError::EqualPoints.into()),
            None => Err(failed),
        }
    }

    /// The retraction on the branch of a guess of the initial velocity: by Newton's method from there, and only that.
    ///
    /// # Errors
    /// Like those of [`retract`](Self::retract).
    pub fn retract_near<const N: usize>(
        &self,
        t: f64,
        x: &DiscretePoint<N>,
        guess: &SVector<f64, N>,
    ) -> Result<Retraction<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        self.marked(t, self.between_near(t, x, guess)?)
    }

    /// The same without a search for the first conjugate point.
    pub(crate) fn between_near<const N: usize>(
        &self,
        t: f64,
        x: &DiscretePoint<N>,
        guess: &SVector<f64, N>,
    ) -> Result<Retraction<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        x.check()?;
        self.by_newton(t, x, guess, &mut Work::default())
    }

    /// The different motions among those that Newton's method finds from these guesses of the initial velocity, in the order of
    /// the guesses; guesses that lead nowhere are left out. Two motions are the same if their velocities agree to half of the
    /// digits.
    ///
    /// # Errors
    /// [`ExactError::Input`] for a point that is not finite.
    pub fn branches<const N: usize>(
        &self,
        t: f64,
        x: &DiscretePoint<N>,
        guesses: &[SVector<f64, N>],
    ) -> Result<Vec<Retraction<N>>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        x.check()?;
        let mut found: Vec<Retraction<N>> = Vec::new();
        for guess in guesses {
            if let Ok(new) = self.by_newton(t, x, guess, &mut Work::default()) {
                let same = |old: &Retraction<N>| {
                    let apart = (old.start.v - new.start.v).amax();
                    apart <= f64::EPSILON.sqrt() * old.start.v.amax().max(new.start.v.amax())
                };
                if !found.iter().any(same) {
                    found.push(self.marked(t, new)?);
                }
            }
        }
        Ok(found)
    }

    /// The motion over any scalar that starts near a motion found before, as a function of the two points: the derivatives of
    /// the end points go through flow and shooting. Newton's method with the slope of the values: each pass makes one more
    /// order of differentials exact.
    pub(crate) fn lifted<T: Scalar, const N: usize>(
        &self,
        t: f64,
        x: &DiscretePoint<N, T>,
        guess: Option<&SVector<f64, N>>,
    ) -> Result<(VelocityPoint<N, T>, Motion<N, T>), ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let values = DiscretePoint { q0: x.q0.map(|c| c.re()), q1: x.q1.map(|c| c.re()), z0: x.z0.re() };
        let near = match guess {
            Some(guess) => *guess,
            None => self.between(t, &values)?.start.v,
        };
        let Found { retraction, inverse, .. } =
            self.shoot(t, &values, &near, (self.h, ACCURACY), &mut Work::default())?;
        let mut start = VelocityPoint { q: x.q0, v: retraction.start.v.map(T::from), z: x.z0 };
        let mut before = f64::INFINITY;
        for pass in 0..ITERATIONS {
            let motion = herglotz_flow(&self.lagrangian, t, &start, self.h)?;
            let missed = SVector::<T, N>::from_fn(|i, _| motion.displacement[i] - (x.q1[i] - x.q0[i]));
            let size = missed.iter().map(|m| m.extent()).fold(0.0, f64::max);
            let scale = motion.displacement.iter().map(|d| d.extent()).fold(0.0, f64::max);
            // Differentials of second order may grow in the passes in which those of first order vanish.
            if size <= 2.0 * f64::EPSILON * scale || (pass >= 3 && size >= 0.5 * before) {
                return Ok((start, motion));
            }
            before = size;
            for i in 0..N {
                for j in 0..N {
                    start.v[i] -= missed[j] * inverse[(i, j)];
                }
            }
        }
        Err(ExactError::NotConverged { last: retraction.start, residual: before, smallest: smallest(&inverse) })
    }

    /// The motion by collocation on one panel with both positions given, from a guess of the initial velocity and of the
    /// inverse of `dq1/dv0`; if the iteration contracts and the error is below round-off. With it the factor of contraction.
    fn by_collocation<const N: usize>(
        &self,
        t: f64,
        x: &DiscretePoint<N>,
        v0: &mut SVector<f64, N>,
        inverse: &SMatrix<f64, N, N>,
        patience: f64,
    ) -> Result<Option<(Retraction<N>, f64)>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let rates = Herglotz(&self.lagrangian);
        let from = State { q: x.q0, v: *v0, z: x.z0, b: 0.0 };
        let start = rates.at(t, &from)?;
        let end = End { displacement: &(x.q1 - x.q0), inverse, patience };
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
                    // The iteration contracts before the first conjugate point only.
                    conjugate: None,
                    route: RetractionRoute::Collocation,
                    evaluations,
                },
                panel.contraction,
            )),
            _ => None,
        })
    }

    /// A retraction with the time by which its motion has met a conjugate point.
    fn marked<const N: usize>(&self, t: f64, found: Retraction<N>) -> Result<Retraction<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        const PARTS: u32 = 32;
        let (part, mut at, mut work) = (self.h / f64::from(PARTS), seeded(&found.start), Work::default());
        for k in 0..PARTS {
            at = self.shot(t + f64::from(k) * part, &at, part, ROUGH, &mut work)?.end;
            if reverses(SMatrix::<f64, N, N>::from_fn(|i, j| at.q[i].d[j])) {
                return Ok(Retraction { conjugate: Some(f64::from(k + 1) * part), ..found });
            }
        }
        Ok(Retraction { conjugate: None, ..found })
    }

    /// The motion with its derivatives in the initial velocity, to an accuracy.
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

    /// The inverse of `dq1/dv0` along the motion from a start, to the accuracy of a guess; none where it is nearly singular, or the
    /// motion not defined.
    fn slope_inverse<const N: usize>(
        &self,
        t: f64,
        start: &VelocityPoint<N>,
        work: &mut Work,
    ) -> Option<SMatrix<f64, N, N>>
    where
        L: Lagrangian<N>,
    {
        let shot = self.shot(t, &seeded(start), self.h, ROUGH, work).ok()?;
        slope(&shot).try_inverse().filter(|inverse| regularity(&shot, inverse, self.h) > NEARLY)
    }

    /// Newton's method on `exp_h`: to some digits first; the rest by collocation with the slope found, or else to the end.
    fn by_newton<const N: usize>(
        &self,
        t: f64,
        x: &DiscretePoint<N>,
        guess: &SVector<f64, N>,
        work: &mut Work,
    ) -> Result<Retraction<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        let rough = self.shoot(t, x, guess, (self.h, ROUGH), work)?;
        let near = rough.retraction.start.v;
        let regular = rough.regularity > NEARLY;
        if regular && let Some((found, _)) = self.by_collocation(t, x, &mut { near }, &rough.inverse, 1.0)? {
            // Still the motion that Newton's method has found, not another one.
            if (found.start.v - near).amax() <= ROUGH.sqrt() * near.amax() {
                return Ok(Retraction { route: RetractionRoute::Newton, ..found });
            }
        }
        Ok(self.shoot(t, x, &near, (self.h, ACCURACY), work)?.retraction)
    }

    /// Newton's method on `exp_h` with the slope `dq1/dv0` of the variational equation. A change that takes the motion out of
    /// its domain, or farther from the second point, is halved.
    fn shoot<const N: usize>(
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
        for _ in 0..ITERATIONS {
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
            // The next change is about now^3 / before^2 or, at round-off, what moves no position.
            let predicted = last_correction(now, before, 2.0 * accuracy * size.max(now));
            let resolution = 2.0 * accuracy * (x.q0.amax().max(x.q1.amax()) / h.abs()).max(size);
            let stagnant = now >= 0.5 * before && now <= 64.0 * resolution;
            if residual == 0.0 || (before.is_finite() && (predicted || stagnant)) {
                let Some(inverse) = slope.try_inverse() else { break };
                let regularity = regularity(&shot, &inverse, h);
                if regularity.is_nan() || regularity <= CONJUGATE {
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
        // Newton's method is slow, and its limit ill determined, where the slope nearly vanishes.
        Err(if fold.sine <= f64::EPSILON.sqrt() && !fold.decayed {
            ExactError::ConjugatePoint { last: start, residual, smallest }
        } else {
            ExactError::NotConverged { last: start, residual, smallest }
        })
    }

    /// Continuation: the motions in the times `s h` to the points `q0 + s (q1 - q0)`, for s from small to 1, each the guess for
    /// the next.
    fn lead<const N: usize>(&self, t: f64, x: &DiscretePoint<N>, work: &mut Work) -> Option<Found<N>>
    where
        L: Lagrangian<N>,
    {
        let (mut s, mut step) = (0.0, 0.125);
        let mut v = (x.q1 - x.q0) / self.h;
        while step > 1e-3 && !work.is_done() {
            let next = f64::min(s + step, 1.0);
            let target = DiscretePoint { q1: x.q0 + (x.q1 - x.q0) * next, ..*x };
            let accuracy = if next < 1.0 { ROUGH } else { ACCURACY };
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

/// The motion after the last small change of its initial velocity, to first order in it: no further pass is needed.
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
