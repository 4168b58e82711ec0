//! Shooting: the motion from a family of starts whose end has given positions, or given momenta.

use super::{ContactFlowError, ContactMotion, contact_flow};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::numbers::{max_abs_or_nan, max_or_nan};
use contact_geom::support::linear::solve;
use contact_geom::{ContactHamiltonian, Dual, PhasePoint, Scalar};

/// The largest number of iterations of Newton's method over real numbers.
const MAX_ITERATIONS: usize = 64;
/// The largest number of corrections of the differentials: each corrects one order of them.
const MAX_CORRECTIONS: usize = 8;
/// A correction below this, relative to the unknown, is round-off once the residual does not decrease further.
const PLATEAU: f64 = 1e-9;
/// The smallest singular value of the derivative, relative to that of the whole end, below which the end counts as
/// conjugate: some units of round-off, to which the derivative is known.
const MIN_REGULARITY: f64 = 64.0 * f64::EPSILON;

/// Which half of the end is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Given {
    Position,
    Momentum,
}

impl Given {
    fn of<const N: usize, T: Scalar>(self, x: &PhasePoint<N, T>) -> SVector<T, N> {
        if self == Given::Position { x.q } else { x.p }
    }
}

/// A number with its derivatives in the unknown of the start.
pub(super) type Unknown<const N: usize> = Dual<f64, SVector<f64, N>>;

/// A motion with its start, and the unknown that determines it.
pub(super) struct Shot<const N: usize, T> {
    pub unknown: SVector<T, N>,
    pub start: PhasePoint<N, T>,
    pub motion: ContactMotion<N, T>,
}

/// The motions to search among: the Hamiltonian, the span, and the starts as a function of N unknowns.
pub(super) struct Search<'a, H, T, R, L> {
    pub hamiltonian: &'a H,
    pub t: T,
    pub duration: T,
    pub given: Given,
    /// The start for unknowns over [`Unknown`].
    pub real: R,
    /// The start for unknowns over T.
    pub lifted: L,
}

fn largest<const N: usize>(x: &SVector<f64, N>) -> f64 {
    max_abs_or_nan(x.iter().copied())
}

impl<H, T: Scalar, R, L> Search<'_, H, T, R, L> {
    /// The motion whose end has the given half equal to a target, from a guess of the unknown, by Newton's method with
    /// corrections that are shortened until the residual decreases. Over a scalar with differentials the result has
    /// those of the solution.
    pub fn solve<const N: usize>(
        &self,
        target: &SVector<T, N>,
        guess: &SVector<f64, N>,
    ) -> Result<Shot<N, T>, ContactFlowError<N>>
    where
        H: ContactHamiltonian<N>,
        R: Fn(&SVector<Unknown<N>, N>) -> PhasePoint<N, Unknown<N>>,
        L: Fn(&SVector<T, N>) -> PhasePoint<N, T>,
    {
        let goal = target.map(|e| e.re());
        for (what, x) in [("given end", &goal), ("guess", guess)] {
            if !x.iter().all(|e| e.is_finite()) {
                return Err(ContactFlowError::NonFinite { what });
            }
        }
        let (t, duration) = (Unknown::from(self.t.re()), Unknown::from(self.duration.re()));
        let shoot = |unknown: &SVector<f64, N>| {
            let mut seeded = unknown.map(Unknown::from);
            for i in 0..N {
                seeded[i].d[i] = 1.0;
            }
            let start = (self.real)(&seeded);
            contact_flow(self.hamiltonian, t, &start, duration).map(|motion| (start, motion))
        };
        let residual = |motion: &ContactMotion<N, Unknown<N>>| self.given.of(&motion.end).map(|e| e.re) - goal;
        let mut unknown = *guess;
        let (mut start, mut motion) = shoot(&unknown)?;
        let mut off = residual(&motion);
        let mut inverse = self.inverse(&start, &motion)?;
        let mut converged = false;
        for _ in 0..MAX_ITERATIONS {
            let before = largest(&off);
            let mut change = inverse * off;
            let end = max_or_nan(largest(&goal), largest(&self.given.of(&motion.end).map(|e| e.re)));
            let scale = max_or_nan(largest(&unknown), inverse.norm() * end);
            if before == 0.0 || largest(&change) <= 2.0 * f64::EPSILON * scale {
                converged = true;
                break;
            }
            let small = largest(&change) <= PLATEAU * scale;
            let mut found = None;
            // Written so that a NaN, or a motion that is not defined, shortens the correction.
            for _ in 0..f64::MANTISSA_DIGITS {
                let next = unknown - change;
                if let Ok((at, to)) = shoot(&next) {
                    let later = residual(&to);
                    if largest(&later) < before {
                        found = Some((next, at, to, later));
                        break;
                    }
                    if small {
                        converged = true;
                        break;
                    }
                }
                change *= 0.5;
            }
            let Some(found) = found else { break };
            (unknown, start, motion, off) = found;
            inverse = self.inverse(&start, &motion)?;
        }
        if !converged {
            return Err(ContactFlowError::NotConverged { last: real(&start), residual: largest(&off) });
        }
        self.lift(target, &unknown, &inverse)
    }

    /// The inverse of the derivative of the given half of the end in the unknowns.
    fn inverse<const N: usize>(
        &self,
        start: &PhasePoint<N, Unknown<N>>,
        motion: &ContactMotion<N, Unknown<N>>,
    ) -> Result<SMatrix<f64, N, N>, ContactFlowError<N>> {
        let block = self.given.of(&motion.end);
        let matrix = SMatrix::<f64, N, N>::from_fn(|i, j| block[i].d[j]);
        let mut inverse = SMatrix::<f64, N, N>::zeros();
        let conjugate = |smallest: f64| ContactFlowError::Conjugate { last: real(start), smallest };
        for j in 0..N {
            let mut unit = SVector::<f64, N>::from_fn(|i, _| if i == j { 1.0 } else { 0.0 });
            solve(&mut matrix.clone_owned(), &mut unit).map_err(|_| conjugate(0.0))?;
            inverse.set_column(j, &unit);
        }
        let size = |x: &SVector<Unknown<N>, N>| max_abs_or_nan(x.iter().flat_map(|e| e.d.iter().copied()));
        let smallest = 1.0 / inverse.norm() / max_or_nan(size(&motion.end.q), size(&motion.end.p));
        if smallest >= MIN_REGULARITY { Ok(inverse) } else { Err(conjugate(smallest)) }
    }

    /// The solution over T from the real one.
    fn lift<const N: usize>(
        &self,
        target: &SVector<T, N>,
        unknown: &SVector<f64, N>,
        inverse: &SMatrix<f64, N, N>,
    ) -> Result<Shot<N, T>, ContactFlowError<N>>
    where
        H: ContactHamiltonian<N>,
        L: Fn(&SVector<T, N>) -> PhasePoint<N, T>,
    {
        let mut unknown = unknown.map(T::from);
        let mut before = f64::INFINITY;
        let size = |x: &SVector<T, N>| max_abs_or_nan(x.iter().map(|e| e.extent()));
        for correction in 0.. {
            let start = (self.lifted)(&unknown);
            let motion = contact_flow(self.hamiltonian, self.t, &start, self.duration)?;
            let end = self.given.of(&motion.end);
            let off = end - target;
            let change = SVector::from_fn(|i, _| (0..N).fold(T::zero(), |sum, j| sum + off[j] * inverse[(i, j)]));
            let scale = max_or_nan(size(&unknown), inverse.norm() * max_or_nan(size(target), size(&end)));
            let relative = if size(&change) == 0.0 { 0.0 } else { size(&change) / scale };
            if relative <= 4.0 * f64::EPSILON || (relative <= PLATEAU && relative >= 0.5 * before) {
                return Ok(Shot { unknown, start, motion });
            }
            if correction == MAX_CORRECTIONS || !relative.is_finite() {
                return Err(ContactFlowError::NotConverged { last: real(&start), residual: size(&off) });
            }
            (before, unknown) = (relative, unknown - change);
        }
        Err(ContactFlowError::NonFinite { what: "motion" })
    }
}

/// The real part of a state.
pub(super) fn real<const N: usize, T: Scalar>(x: &PhasePoint<N, T>) -> PhasePoint<N> {
    PhasePoint { q: x.q.map(T::re), p: x.p.map(T::re), z: x.z.re() }
}
