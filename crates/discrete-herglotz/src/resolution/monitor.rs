//! What a run sees of steps that do not resolve its motion.

use crate::numbers::state_words::{Saved, load_option, save_option, saved};
use crate::{UnresolvedStep, integration::SuspectInterval};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    PhasePoint,
    numbers::{max_abs_or_nan, max_or_nan},
};

/// What a run notes of its own steps: the first that cannot have resolved the motion, and the last that may not have.
///
/// The measure is two second differences of velocities in sequence, of opposite directions: their sum, in units of the largest of
/// the velocities. An oscillation of frequency omega has them where its velocity vanishes, and they are as large as that for
/// steps longer than a sixth of a period; a step past a pole of a force, or through a pulse, has them as the force comes and
/// goes. A velocity that only grows, from rest and at whatever rate, has second differences of one direction.
///
/// One second difference alone tells less: it is `(omega h)^2` of the velocity, and a force that jumps has one too. So a larger one than
/// all before is a [`SuspectInterval`], for the run to look at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ResolutionMonitor<const N: usize> {
    pub first: Option<UnresolvedStep>,
    pub doubt: Option<SuspectInterval<N>>,
    /// The square of the second difference, in units of the velocity, beyond which the next one is a doubt.
    pub sharpest: f64,
    /// What a turn moves at most that is rounding.
    pub floor: f64,
}

/// The second difference of the velocity, in units of the velocity, that is the first doubt: a smooth motion has it with 28 steps in a
/// period.
const SHARP: f64 = 0.05;

/// What moves a position by less than this part of it is its rounding.
pub(crate) const ROUNDED: f64 = 1e-10;

/// What rounding moves a motion from this start by, at most. Forces are rounded as they are at its size, so that this holds too where it has
/// come to rest beside the origin.
pub(crate) fn rounding<const N: usize>(q: &SVector<f64, N>, v: &SVector<f64, N>, h: f64) -> f64 {
    let reach = max_or_nan(size(q), size(v) * h.abs());
    if reach.is_finite() { ROUNDED * reach } else { 0.0 }
}

impl<const N: usize> ResolutionMonitor<N> {
    /// Of a motion from a position and a velocity, by steps of h.
    pub fn new(q: &SVector<f64, N>, v: &SVector<f64, N>, h: f64) -> Self {
        ResolutionMonitor { first: None, doubt: None, sharpest: SHARP * SHARP, floor: rounding(q, v, h) }
    }

    /// Notes the first step with a misfit above one.
    #[cold]
    #[inline(never)]
    pub fn note(&mut self, step: usize, defect: f64) {
        if self.first.is_none() {
            self.first = Some(UnresolvedStep { step, defect });
            // One is enough.
            self.sharpest = f64::INFINITY;
        }
    }

    /// Notes a doubt after a turn of this sharpness. The next is twice as sharp, so that there are few.
    #[cold]
    #[inline(never)]
    pub fn doubt(&mut self, sharpness: f64, doubt: SuspectInterval<N>) {
        self.sharpest = 4.0 * sharpness;
        self.doubt = Some(doubt);
    }
}

/// The largest component of a vector.
pub(crate) fn size<const N: usize>(x: &SVector<f64, N>) -> f64 {
    max_abs_or_nan(x.iter().copied())
}

/// The sharpness of a turn within a time h, the square of a second difference of the velocity in units of the velocity, where it is beyond
/// the sharpest so far; `None` where it is not, and where it moves the position q by no more than rounding.
#[inline(always)]
pub(crate) fn sharper<const N: usize>(
    [turn, velocity, q]: [&SVector<f64, N>; 3],
    h: f64,
    floor: f64,
    sharpest: f64,
) -> Option<f64> {
    if turn.dot(turn) > sharpest * velocity.dot(velocity) { sharpness([turn, velocity, q], h, floor) } else { None }
}

#[cold]
#[inline(never)]
fn sharpness<const N: usize>([turn, velocity, q]: [&SVector<f64, N>; 3], h: f64, floor: f64) -> Option<f64> {
    let moves = size(turn) * h.abs() > max_or_nan(ROUNDED * size(q), floor);
    moves.then(|| turn.dot(turn) / velocity.dot(velocity))
}

/// What rounding may have changed of the value of L, from that of its terms and of its forces at a position: beside an equilibrium at which
/// terms cancel a potential is a square of what is left, and its rounding one of the second order.
pub(crate) fn value_rounding<const N: usize>(of_terms: f64, of_force: &SVector<f64, N>, q: &SVector<f64, N>) -> f64 {
    of_terms + size(of_force) * size(q)
}

/// Whether velocities move by no more than rounding in a step of h.
pub(crate) fn at_rest<const N: usize>(velocities: [&SVector<f64, N>; 4], h: f64, floor: f64) -> bool {
    max_abs_or_nan(velocities.into_iter().flatten().copied()) * h.abs() <= floor
}

/// The misfit of four velocities in sequence, steps of h apart, the last of them at the position q; `None` where it is at most one.
#[inline(always)]
pub(crate) fn defect<const N: usize>(
    [first, second, third, fourth]: [&SVector<f64, N>; 4],
    q: &SVector<f64, N>,
    h: f64,
    floor: f64,
) -> Option<f64> {
    let before = second * -2.0 + first + third;
    let now = third * -2.0 + second + fourth;
    if now.dot(&before) < 0.0 { turning([&before, &now], [second, third, fourth], q, h, floor) } else { None }
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
    floor: f64,
) -> Option<f64> {
    let change = size(changes[0]) + size(changes[1]);
    let velocity = max_abs_or_nan(velocities.map(size));
    (change > velocity && change * h.abs() > max_or_nan(LEAST * size(q), floor)).then(|| change / velocity)
}

/// See [`turning`]; the same for the difference of a step from two halves.
pub(crate) const LEAST: f64 = 1.0 / 256.0;

/// The misfit of a rational conformal factor, the exponential of a rate in the motion itself: above one where a step contracts or
/// grows by more than three. `(1 + x)/(1 - x)`, which is three at `x = 1/2`, is then off by a tenth or more.
#[inline(always)]
pub(crate) fn factor_defect(sigma: f64) -> Option<f64> {
    if (1.0 / 3.0..=3.0).contains(&sigma) { None } else { Some(sigma.ln().abs() / 3.0f64.ln()) }
}

saved!([const N: usize] SuspectInterval<N> { step, steps, t, from, to });
saved!([] UnresolvedStep { step, defect });

impl<const N: usize> Saved for ResolutionMonitor<N> {
    fn save(&self, to: &mut Vec<u64>) {
        save_option(self.first.as_ref(), to);
        save_option(self.doubt.as_ref(), to);
        [self.sharpest, self.floor].save(to);
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        self.first = load_option(from, || UnresolvedStep { step: 0, defect: 0.0 })?;
        let nowhere = PhasePoint { q: SVector::zeros(), p: SVector::zeros(), z: 0.0 };
        self.doubt = load_option(from, || SuspectInterval { step: 0, steps: 0, t: 0.0, from: nowhere, to: nowhere })?;
        self.sharpest.load(from)?;
        self.floor.load(from)
    }
}
