//! Convergence test of the iterations for the stages.

use crate::StepError;

/// The outcome of one iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum IterationOutcome {
    /// Another iteration is needed.
    Continue,
    /// The stages are solved to round-off.
    Done,
    /// The iteration does not converge; the largest change of the last iteration, relative to the terms.
    Slow { change: f64, sweeps: u32 },
    /// A value is not finite.
    NonFinite,
    /// The integrating factor of a stage is not positive.
    StageFactor { rho: f64 },
    /// The Lagrangian branches on one value where the SIMD lanes differ.
    Branched,
    /// The conformal factor of the step is not positive.
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

/// The number of iterations after which the iteration counts as not converging.
const LIMIT: u32 = 60;

/// The largest relative change for which the last two values of a force determine its slope.
const TELLING: f64 = 0.1;

/// The number of simplified Newton iterations above which the Jacobian is recomputed: three times the usual number.
pub(crate) const SLOW: u32 = 18;

/// The smallest number of steps for which a Jacobian is kept, unless a step fails: second derivatives by dual numbers
/// cost as much as ten steps.
pub(crate) const AGE: u32 = 16;

/// The convergence test of a fixed-point iteration or simplified Newton iteration in one step.
///
/// The iteration ends when the next change, predicted from the last two, is a small fraction of the round-off of the
/// terms, or when changes near round-off, or changes that do not move the positions, no longer decrease. It fails when
/// larger changes have failed to decrease more than three times, or at the limit on the number of iterations.
#[derive(Default)]
pub(crate) struct FixedPointIteration {
    enough: f64,
    left: f64,
    count: u32,
    /// The change of the first iteration, and its largest term.
    first: (f64, f64),
    before: f64,
    ratio: f64,
    /// Whether a secant step, without evaluations of the force, lies between the last change and the next, and whether
    /// one is to follow the last iteration.
    ahead: bool,
    ends_ahead: bool,
    risen: u32,
    /// Whether the last iteration has moved the positions by no more than their round-off. For stiff forces this
    /// changes the accelerations by more than the round-off of the accelerations.
    pub still: bool,
    /// Whether this iteration is expected to be the last: its predicted change is round-off.
    last: bool,
}

impl FixedPointIteration {
    /// An iteration that ends when a change is at most `enough` times the round-off of the terms, or when the next
    /// change is predicted to be at most `left` times it. The remaining error has the same direction in every step and
    /// accumulates in proportion to the number of steps, whereas round-off accumulates like its square root.
    pub fn until(enough: f64, left: f64) -> Self {
        FixedPointIteration { enough, left, ..FixedPointIteration::default() }
    }

    pub fn count(&self) -> u32 {
        self.count
    }

    /// The change of the first iteration relative to the largest term: the relative error of the predictor.
    pub fn first(&self) -> f64 {
        self.first.0 / self.first.1
    }

    /// The change of the first iteration.
    pub fn first_change(&self) -> f64 {
        self.first.0
    }

    /// Whether a secant step follows this change, given relative to the terms: if the changes decrease, and are small
    /// enough to determine the slope of the force. The caller must then take it.
    pub fn secant_step(&mut self, change: f64) -> bool {
        self.ahead = self.count > 1 && self.ratio < 0.5 && change <= TELLING;
        self.ahead
    }

    /// Whether the iteration ends with one more secant step: its end was predicted from a change that followed one.
    pub fn ends_ahead(&self) -> bool {
        self.ends_ahead
    }

    /// Evaluates an iteration by its largest change and the largest term.
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
            // The larger of the last two contraction factors: the first is often that of components that decay at once.
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
