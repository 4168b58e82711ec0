//! Detection of steps that do not resolve the motion.

use crate::numbers::state_words::{Saved, load_option, save_option, saved};
use crate::resolution::thresholds::{
    MAX_RATIONAL_FACTOR, MIN_RELATIVE_DISPLACEMENT, MIN_SUSPECT_DIFFERENCE, MIN_SUSPECT_GROWTH, POSITION_ROUND_OFF,
};
use crate::{State, UnresolvedStep, Vector, integration::SuspectInterval};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    PhasePoint,
    numbers::{max_abs_or_nan, max_or_nan},
};

/// Monitor of the steps of a run: the first step that cannot have resolved the motion, and when an interval is suspect.
///
/// The defect of a step is the sum of two consecutive second differences of the velocity with opposite directions, in
/// units of the largest of the velocities. An oscillation of frequency omega has such differences where its velocity
/// vanishes, and the defect exceeds one for steps longer than a sixth of a period. A step past a pole of the force, or
/// through a pulse, has them as the force rises and falls. A velocity that only grows, from rest and at any rate, has
/// second differences in one direction.
///
/// A single second difference is a weaker indication: it is `(omega h)^2` times the velocity, and a jump of the force
/// also causes one. One that is larger than all before therefore yields a [`SuspectInterval`], which the run examines.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepMonitor {
    pub first: Option<UnresolvedStep>,
    /// The threshold for the next suspect interval: the square of a second difference, in units of the velocity.
    pub sharpest: f64,
    /// Changes of position below this are round-off.
    pub floor: f64,
}

impl StepMonitor {
    /// A monitor for a motion from a position and a velocity, with steps of length h.
    pub fn new(q: &[f64], v: &[f64], h: f64) -> Self {
        let sharpest = MIN_SUSPECT_DIFFERENCE * MIN_SUSPECT_DIFFERENCE;
        StepMonitor { first: None, sharpest, floor: rounding(q, v, h) }
    }

    /// Records the first step with a defect above one.
    #[cold]
    #[inline(never)]
    pub fn note(&mut self, step: usize, defect: f64) {
        if self.first.is_none() {
            self.first = Some(UnresolvedStep { step, defect });
            // A run reports one unresolved step, and needs no suspect intervals after it.
            self.sharpest = f64::INFINITY;
        }
    }

    /// Raises the threshold after a suspect interval with this sharpness: the next one needs a larger second difference.
    pub fn suspect(&mut self, sharpness: f64) {
        self.sharpest = MIN_SUSPECT_GROWTH * MIN_SUSPECT_GROWTH * sharpness;
    }
}

/// The monitor of the steps of a run, with the latest suspect interval.
#[derive(Clone, Debug)]
pub(crate) struct ResolutionMonitor {
    pub steps: StepMonitor,
    pub suspect: Option<SuspectInterval>,
    /// The number of coordinates.
    dimension: usize,
}

/// A bound for the changes of position by round-off in a motion from this initial state. It is relative to the size of
/// the initial position, so that it also holds where the motion has come to rest near the origin.
pub(crate) fn rounding(q: &[f64], v: &[f64], h: f64) -> f64 {
    let extent = max_or_nan(size(q), size(v) * h.abs());
    if extent.is_finite() { POSITION_ROUND_OFF * extent } else { 0.0 }
}

impl ResolutionMonitor {
    /// A monitor for a motion from a position and a velocity, with steps of length h.
    pub fn new(q: &[f64], v: &[f64], h: f64) -> Self {
        ResolutionMonitor { steps: StepMonitor::new(q, v, h), suspect: None, dimension: q.len() }
    }

    /// Records a suspect interval with this sharpness: the number of steps before it and in it, its start, and the states
    /// at its ends.
    #[cold]
    #[inline(never)]
    pub fn suspect<const N: usize>(
        &mut self,
        sharpness: f64,
        (step, steps, t): (usize, usize, f64),
        [from, to]: [&PhasePoint<N>; 2],
    ) {
        self.steps.suspect(sharpness);
        self.suspect = Some(SuspectInterval { step, steps, t, from: from.into(), to: to.into() });
    }
}

/// The largest absolute component of a vector.
pub(crate) fn size(x: &[f64]) -> f64 {
    max_abs_or_nan(x.iter().copied())
}

/// The sharpness of a change of the velocity within a time h: the square of its second difference, in units of the
/// velocity. `None` where it does not exceed the sharpest so far, and where it changes the position q by no more than
/// round-off.
#[inline(always)]
pub(crate) fn sharper<const N: usize>(
    [turn, velocity, q]: [&SVector<f64, N>; 3],
    h: f64,
    floor: f64,
    sharpest: f64,
) -> Option<f64> {
    let (of_turn, of_velocity) = (turn.dot(turn), velocity.dot(velocity));
    if of_turn > sharpest * of_velocity && moves([turn.as_slice(), q.as_slice()], h, floor) {
        Some(of_turn / of_velocity)
    } else {
        None
    }
}

/// [`sharper`] for vectors of any length.
pub(crate) fn sharper_of([turn, velocity, q]: [&[f64]; 3], h: f64, floor: f64, sharpest: f64) -> Option<f64> {
    let square = |x: &[f64]| x.iter().fold(0.0, |sum, x| sum + x * x);
    let (of_turn, of_velocity) = (square(turn), square(velocity));
    (of_turn > sharpest * of_velocity && moves([turn, q], h, floor)).then(|| of_turn / of_velocity)
}

/// Whether a change of the velocity within a time h changes the position q by more than round-off.
#[cold]
#[inline(never)]
fn moves([turn, q]: [&[f64]; 2], h: f64, floor: f64) -> bool {
    size(turn) * h.abs() > max_or_nan(POSITION_ROUND_OFF * size(q), floor)
}

/// A bound for the round-off of the value of L, from the round-off of its terms and of its forces at a position. The
/// forces are included because near an equilibrium at which terms cancel, the potential is small of second order in the
/// displacement.
pub(crate) fn value_rounding(of_terms: f64, of_force: &[f64], q: &[f64]) -> f64 {
    of_terms + size(of_force) * size(q)
}

/// Whether the velocities change the position by no more than round-off in a step of length h.
pub(crate) fn at_rest<const N: usize>(velocities: [&SVector<f64, N>; 4], h: f64, floor: f64) -> bool {
    max_abs_or_nan(velocities.into_iter().flatten().copied()) * h.abs() <= floor
}

/// The defect of four consecutive velocities, at steps of length h, the last of them at the position q; `None` where it
/// is at most one.
#[inline(always)]
pub(crate) fn defect<const N: usize>(
    [first, second, third, fourth]: [&SVector<f64, N>; 4],
    q: &SVector<f64, N>,
    h: f64,
    floor: f64,
) -> Option<f64> {
    let before = second * -2.0 + first + third;
    let now = third * -2.0 + second + fourth;
    let velocities = [second.as_slice(), third.as_slice(), fourth.as_slice()];
    let changes = [before.as_slice(), now.as_slice()];
    if now.dot(&before) < 0.0 { turning(changes, velocities, q.as_slice(), h, floor) } else { None }
}

/// The defect of two second differences of opposite directions among three velocities; `None` where it is at most one.
///
/// Differences that change q by less than [`MIN_RELATIVE_DISPLACEMENT`] of its size are ignored.
#[inline(never)]
pub(crate) fn turning(changes: [&[f64]; 2], velocities: [&[f64]; 3], q: &[f64], h: f64, floor: f64) -> Option<f64> {
    let change = size(changes[0]) + size(changes[1]);
    let velocity = max_abs_or_nan(velocities.map(size));
    (change > velocity && change * h.abs() > max_or_nan(MIN_RELATIVE_DISPLACEMENT * size(q), floor))
        .then(|| change / velocity)
}

/// The defect of a rational conformal factor, which approximates an exponential: it exceeds one where a step contracts
/// or expands by more than [`MAX_RATIONAL_FACTOR`].
#[inline(always)]
pub(crate) fn factor_defect(sigma: f64) -> Option<f64> {
    let resolved = (1.0 / MAX_RATIONAL_FACTOR..=MAX_RATIONAL_FACTOR).contains(&sigma);
    if resolved { None } else { Some(sigma.ln().abs() / MAX_RATIONAL_FACTOR.ln()) }
}

saved!([] SuspectInterval { step, steps, t, from, to });
saved!([] UnresolvedStep { step, defect });

impl Saved for ResolutionMonitor {
    fn save(&self, to: &mut Vec<u64>) {
        save_option(self.steps.first.as_ref(), to);
        save_option(self.suspect.as_ref(), to);
        [self.steps.sharpest, self.steps.floor].save(to);
    }
    fn load(&mut self, from: &mut &[u64]) -> Option<()> {
        self.steps.first = load_option(from, || UnresolvedStep { step: 0, defect: 0.0 })?;
        let nowhere = || State::new(Vector::zeros(self.dimension), Vector::zeros(self.dimension), 0.0);
        let interval = || SuspectInterval { step: 0, steps: 0, t: 0.0, from: nowhere(), to: nowhere() };
        self.suspect = load_option(from, interval)?;
        self.steps.sharpest.load(from)?;
        self.steps.floor.load(from)
    }
}
