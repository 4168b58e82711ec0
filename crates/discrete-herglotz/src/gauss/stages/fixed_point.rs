//! When an iteration of the stages ends.

use crate::StepError;

/// What is to be done after a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum IterationOutcome {
    /// Another sweep.
    Continue,
    /// The stages are solved to round-off.
    Done,
    /// The iteration does not contract: the largest change of the last sweep, relative to the terms.
    Slow { change: f64, sweeps: u32 },
    /// A value is not finite.
    NonFinite,
    /// The integrating factor of a stage is not positive.
    StageFactor { rho: f64 },
    /// The Lagrangian branches on a value of its own, other than lane by lane.
    Branched,
    /// The step is not conformally contact.
    SigmaVanished { sigma: f64 },
}

impl From<IterationOutcome> for StepError {
    fn from(refused: IterationOutcome) -> Self {
        match refused {
            IterationOutcome::SigmaVanished { sigma } => StepError::SigmaVanished { sigma },
            IterationOutcome::StageFactor { rho } => StepError::StageFactor { rho },
            IterationOutcome::Slow { change, sweeps } => {
                StepError::NotConverged { residual: change, iterations: sweeps }
            }
            IterationOutcome::Branched => StepError::Branched,
            _ => StepError::NonFinite,
        }
    }
}

/// The sweeps after which an iteration counts as not contracting.
const LIMIT: u32 = 60;

/// The largest relative change of a sweep after which the last two values of a force tell its slope.
const TELLING: f64 = 0.1;

/// The sweeps of Newton's method above which its Jacobian is taken anew: three times the usual number.
pub(crate) const SLOW: u32 = 18;

/// The steps that a Jacobian serves at the least, unless one is refused: second derivatives by dual numbers cost as much as ten
/// steps.
pub(crate) const AGE: u32 = 16;

/// The changes of the sweeps of one step.
///
/// The iteration ends when the next change, predicted from the last two, is a small part of the round-off of the terms, or when
/// changes near round-off, or that move nothing, no longer fall. It is given up when larger changes have not fallen three times, or
/// at the limit: so it neither stalls nor loops.
#[derive(Default)]
pub(crate) struct FixedPointIteration {
    enough: f64,
    left: f64,
    count: u32,
    /// The change of the first sweep, and the largest term in it.
    first: (f64, f64),
    before: f64,
    ratio: f64,
    /// Whether a sweep ahead, without forces, lies between the last change and the next, and whether one is to follow the last.
    ahead: bool,
    ends_ahead: bool,
    risen: u32,
    /// Whether the last sweep has not moved the positions but for their round-off: where forces are stiff that alone changes
    /// the accelerations by more than theirs.
    pub still: bool,
    /// Whether this sweep is the last: its change is round-off.
    last: bool,
}

impl FixedPointIteration {
    /// An iteration that ends with a change of so many times the round-off of its terms, or when the next one is expected to be so small
    /// as what may be left. What is left has the same direction in every step, and so it adds up like the number of steps, where
    /// round-off adds up like its root.
    pub fn until(enough: f64, left: f64) -> Self {
        FixedPointIteration { enough, left, ..FixedPointIteration::default() }
    }

    pub fn count(&self) -> u32 {
        self.count
    }

    /// The change of the first sweep relative to the largest term: how far what the last step foretold was off.
    pub fn first(&self) -> f64 {
        self.first.0 / self.first.1
    }

    /// The change of the first sweep.
    pub fn first_change(&self) -> f64 {
        self.first.0
    }

    /// Whether a sweep ahead is worth it after this change, relative to the terms: the changes fall, and they are small enough to tell the
    /// slope of a force. Then it is taken.
    pub fn secant_step(&mut self, change: f64) -> bool {
        self.ahead = self.count > 1 && self.ratio < 0.5 && change <= TELLING;
        self.ahead
    }

    /// Whether what is left is small after one more sweep ahead, as there was one before each of the last sweeps.
    pub fn ends_ahead(&self) -> bool {
        self.ends_ahead
    }

    /// Judges a sweep by its largest change and the largest term.
    #[inline(always)]
    pub fn judge(&mut self, change: f64, size: f64) -> IterationOutcome {
        self.count += 1;
        let round_off = 0.5 * f64::EPSILON * size;
        let ahead = std::mem::take(&mut self.ahead);
        if change <= self.enough * round_off {
            return IterationOutcome::Done;
        }
        if self.last && change <= 256.0 * round_off {
            self.ends_ahead = ahead;
            return IterationOutcome::Done;
        }
        if !(change + size).is_finite() {
            return IterationOutcome::NonFinite;
        }
        if self.count == 1 {
            self.first = (change, size);
        } else {
            // The slower of the last two contractions: the first is often that of components which die out at once.
            let ratio = change / self.before;
            let expected = f64::max(ratio, if self.count > 2 { self.ratio } else { 0.1 });
            let next = change * expected;
            if next <= self.left * round_off {
                self.ends_ahead = ahead;
                return IterationOutcome::Done;
            }
            self.last = next * expected <= self.left * round_off;
            if ratio >= 1.0 {
                if change <= 256.0 * round_off || self.still {
                    return IterationOutcome::Done;
                }
                self.risen += 1;
            }
            if self.risen > 3 || self.count > LIMIT {
                return IterationOutcome::Slow { change: change / size, sweeps: self.count };
            }
            self.ratio = ratio;
        }
        self.before = change;
        IterationOutcome::Continue
    }
}
