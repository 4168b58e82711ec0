//! The computation of the exact retractions.

use super::retraction::{Retraction, RetractionRoute};
use super::shooting::{Found, reverses, smallest};
use crate::numerics::flow::{ACCURACY, Work};
use crate::{ContactExponential, ExactError, Motion, herglotz_flow};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{DiscretePoint, Lagrangian, Scalar, VelocityPoint};
use discrete_herglotz::{InputError, solve::ITERATION_LIMIT};

/// The contraction factor below which no conjugate point is near. At a conjugate point the slowest mode of the
/// iteration with both positions given has the contraction factor 1, and the next mode 1/4; this is well below both.
const MAX_CONTRACTION_WITHOUT_CONJUGATE_POINT: f64 = 0.1;

/// The contraction factor of an iteration with the derivative `dq1/dv0 = h` of a free motion above which it pays to
/// compute the derivative: at this factor round-off is reached after 30 iterations.
const MAX_CONTRACTION_OF_FREE_MOTION: f64 = 0.3;

/// The largest contraction factor that is accepted of an iteration with this derivative. A larger factor shows that the
/// derivative is that of another motion.
const MAX_CONTRACTION_WITH_DERIVATIVE: f64 = 0.8;

impl<L> ContactExponential<L> {
    /// The retraction of two points at time t.
    ///
    /// If several motions join the points in time h, the result is as a rule the one that is connected to the motions
    /// of shorter times between points on the straight line; [`retract_near`](Self::retract_near) finds others, and
    /// [`conjugate_points`](Self::conjugate_points) shows whether others may exist: before the first conjugate point
    /// the motion is locally unique.
    ///
    /// Collocation with both positions given is tried first, which costs no more than the motion itself; then Newton's
    /// method on `exp_h` from `(q1 - q0)/h`, and then continuation in h.
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
            self.with_conjugate_time(t, found)
        }
    }

    /// The retraction of two points without a search for the first conjugate point, which a jet does not need:
    /// `conjugate` is h where `dq1/dv0` is found to reverse the orientation.
    pub(crate) fn between<const N: usize>(&self, t: f64, x: &DiscretePoint<N>) -> Result<Retraction<N>, ExactError<N>>
    where
        L: Lagrangian<N>,
    {
        x.check()?;
        let mut work = Work::default();
        let guess = (x.q1 - x.q0) / self.h;
        let (free, mut v0) = (SMatrix::from_diagonal_element(1.0 / self.h), guess);
        let quick = self.by_collocation(t, x, &mut v0, &free, MAX_CONTRACTION_OF_FREE_MOTION)?;
        if let Some((found, contraction)) = quick
            && contraction < MAX_CONTRACTION_WITHOUT_CONJUGATE_POINT
        {
            return Ok(found);
        }
        // The iteration is slow, or a conjugate point may be near, where all modes but one contract and that one may be
        // absent. The derivative decides; if the iteration was given up, it is continued with the derivative.
        if let Some(inverse) = self.slope_inverse(t, &VelocityPoint { q: x.q0, v: v0, z: x.z0 }, &mut work) {
            let found = match quick {
                Some(found) => Some(found),
                None => self.by_collocation(t, x, &mut v0, &inverse, MAX_CONTRACTION_WITH_DERIVATIVE)?,
            };
            if let Some((found, _)) = found {
                return Ok(Retraction { conjugate: reverses(inverse).then_some(self.h), ..found });
            }
        }
        let failed = match self.by_newton(t, x, &guess, &mut work) {
            Ok(found) => return Ok(found),
            Err(failed) => failed,
        };
        match self.by_continuation(t, x, &mut work) {
            Some(found) => Ok(Retraction { route: RetractionRoute::Continuation, ..found.retraction }),
            None if x.q0 == x.q1 => Err(InputError::EqualPoints.into()),
            None => Err(failed),
        }
    }

    /// The retraction on the branch of a guess of the initial velocity, by Newton's method from there only.
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
        self.with_conjugate_time(t, self.between_near(t, x, guess)?)
    }

    /// The retraction near a guess without a search for the first conjugate point.
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

    /// The distinct motions that Newton's method finds from these guesses of the initial velocity, in the order of the
    /// guesses; guesses from which it fails are omitted. Two motions are the same if their initial velocities agree to
    /// half of the digits.
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
                    found.push(self.with_conjugate_time(t, new)?);
                }
            }
        }
        Ok(found)
    }

    /// The motion over any scalar as a function of the two points, near a motion found before: the derivatives with
    /// respect to the points are propagated through flow and shooting. The iteration is Newton's method with the
    /// Jacobian of the values; each pass makes one more order of differentials exact.
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
        for pass in 0..ITERATION_LIMIT {
            let motion = herglotz_flow(&self.lagrangian, t, &start, self.h)?;
            let missed = SVector::<T, N>::from_fn(|i, _| motion.displacement[i] - (x.q1[i] - x.q0[i]));
            let size = missed.iter().map(|m| m.extent()).fold(0.0, f64::max);
            let scale = motion.displacement.iter().map(|d| d.extent()).fold(0.0, f64::max);
            // Differentials of second order may grow in the passes in which those of first order converge.
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
}
