//! The exact retractions: the motion from one point to another.

use super::shooting::{Found, ITERATIONS, reverses, smallest};
use crate::numerics::flow::{ACCURACY, Work};
use crate::{ContactExponential, ExactError, Motion, herglotz_flow};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{DiscretePoint, Lagrangian, Scalar, VelocityPoint};
use discrete_herglotz::InputError;

/// The contraction below which a conjugate point is far: the slowest mode of the iteration with both ends given contracts by 1 at
/// a conjugate point, the next by 1/4 there.
const SAFE: f64 = 0.1;

/// The contraction above which the slope is worth its cost.
const PATIENCE: f64 = 0.3;

/// The contraction that an iteration with the slope must have: it shows that the slope is that of this motion.
const SLOPED: f64 = 0.8;

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
}
