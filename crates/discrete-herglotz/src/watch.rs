//! What a run sees of steps that do not resolve its motion.

use crate::Suspicion;
use contact_geom::largest;
use contact_geom::nalgebra::SVector;

/// The first step of a run that cannot have resolved the motion.
///
/// The measure is two second differences of velocities in sequence, of opposite directions: their sum, in units of the largest of
/// the velocities. An oscillation of frequency omega has them where its velocity vanishes, and they are as large as that for
/// steps longer than a sixth of a period; a step past a pole of a force, or through a pulse, has them as the force comes and
/// goes. A velocity that only grows, from rest and at whatever rate, has second differences of one direction.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Watch {
    pub first: Option<Suspicion>,
}

impl Watch {
    /// Notes the first step with a misfit above one.
    #[cold]
    #[inline(never)]
    pub fn note(&mut self, step: usize, misfit: f64) {
        if self.first.is_none() {
            self.first = Some(Suspicion { step, misfit });
        }
    }
}

/// The misfit of four velocities in sequence, steps of h apart, the last of them at the position q; `None` where it is at most one.
#[inline(always)]
pub(crate) fn misfit<const N: usize>(
    [first, second, third, fourth]: [&SVector<f64, N>; 4],
    q: &SVector<f64, N>,
    h: f64,
) -> Option<f64> {
    let before = second * -2.0 + first + third;
    let now = third * -2.0 + second + fourth;
    if now.dot(&before) < 0.0 { turning([&before, &now], [second, third, fourth], q, h) } else { None }
}

/// The misfit of two second differences of opposite directions among three velocities. What moves q by less than a 256th of it is
/// none: a motion that has come to rest keeps velocities of rounding alone, and where velocity and force vanish together the
/// substeps of a long scheme turn by their own errors.
#[inline(never)]
pub(crate) fn turning<const N: usize>(
    changes: [&SVector<f64, N>; 2],
    velocities: [&SVector<f64, N>; 3],
    q: &SVector<f64, N>,
    h: f64,
) -> Option<f64> {
    let size = |x: &SVector<f64, N>| largest(x.iter().copied());
    let change = size(changes[0]) + size(changes[1]);
    let velocity = largest(velocities.map(size));
    (change > velocity && change * h.abs() > LEAST * size(q)).then(|| change / velocity)
}

/// See [`turning`]; the same for the difference of a step from two halves.
pub(crate) const LEAST: f64 = 1.0 / 256.0;

/// The misfit of a rational conformal factor, the exponential of a rate in the motion itself: above one where a step contracts or
/// grows by more than three. `(1 + x)/(1 - x)`, which is three at `x = 1/2`, is then off by a tenth or more.
#[inline(always)]
pub(crate) fn factor_misfit(sigma: f64) -> Option<f64> {
    if (1.0 / 3.0..=3.0).contains(&sigma) { None } else { Some(sigma.ln().abs() / 3.0f64.ln()) }
}
