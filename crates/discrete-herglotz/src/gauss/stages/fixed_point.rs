//! Convergence test of the iterations for the stages.

use crate::StepError;
use crate::gauss::limits::{MAX_INCREASES, MAX_ITERATIONS, MAX_SECANT_CHANGE, MAX_SECANT_RATIO, ROUND_OFF_CHANGE};

/// The outcome of one iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum IterationOutcome {
    /// Another iteration is needed.
    Continue,
    /// The stages are solved to round-off.
    Done,
    /// The iteration does not converge; the largest change of the last iteration, relative to the terms.
    Slow { change: f64, iterations: u32 },
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
            IterationOutcome::Slow { change, iterations } => StepError::NotConverged { residual: change, iterations },
            IterationOutcome::Branched => StepError::Branched,
            _ => StepError::NonFinite,
        }
    }
}

/// The convergence test of a fixed-point iteration or simplified Newton iteration in one step.
///
/// The iteration ends when the next change, predicted from the last two, is a small fraction of the round-off of the
/// terms, or when changes near round-off, or changes that do not move the positions, no longer decrease. It fails when
/// larger changes have failed to decrease more than three times, or at the limit on the number of iterations.
#[derive(Default)]
pub(crate) struct FixedPointIteration {
    enough: f64,
    left: f64,
    /// The remaining error, relative to the terms, at which the iteration may end; 0 for round-off.
    tolerance: f64,
    count: u32,
    /// The change of the first iteration, and its largest term.
    first: (f64, f64),
    before: f64,
    ratio: f64,
    /// Whether a secant step, without evaluations of the force, lies between the last change and the next, and whether
    /// one is to follow the last iteration.
    secant: bool,
    ends_with_secant: bool,
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
    #[inline(always)]
    pub fn until(enough: f64, left: f64) -> Self {
        FixedPointIteration { enough, left, ..FixedPointIteration::default() }
    }

    /// The same, which also ends when the remaining error, by the last contraction factor, is at most `tolerance` times the
    /// terms.
    #[inline(always)]
    pub fn with_tolerance(self, tolerance: f64) -> Self {
        FixedPointIteration { tolerance, ..self }
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
        self.secant = self.count > 1 && self.ratio < MAX_SECANT_RATIO && change <= MAX_SECANT_CHANGE;
        self.secant
    }

    /// Whether the iteration ends with one more secant step: its end was predicted from a change that followed one.
    pub fn ends_with_secant(&self) -> bool {
        self.ends_with_secant
    }

    /// Evaluates an iteration by its largest change and the largest term.
    #[inline(always)]
    pub fn assess(&mut self, change: f64, size: f64) -> IterationOutcome {
        self.count += 1;
        let round_off = 0.5 * f64::EPSILON * size;
        let secant = std::mem::take(&mut self.secant);
        if change <= self.enough * round_off {
            return IterationOutcome::Done;
        }
        if self.last && change <= ROUND_OFF_CHANGE * round_off {
            self.ends_with_secant = secant;
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
            // The changes that are left out add up as a geometric series.
            let negligible = expected < 1.0 && next <= self.tolerance * size * (1.0 - expected);
            if next <= self.left * round_off || negligible {
                self.ends_with_secant = secant;
                return IterationOutcome::Done;
            }
            self.last = next * expected <= self.left * round_off;
            if ratio >= 1.0 {
                if change <= ROUND_OFF_CHANGE * round_off || self.still {
                    return IterationOutcome::Done;
                }
                self.risen += 1;
            }
            if self.risen > MAX_INCREASES || self.count > MAX_ITERATIONS {
                return IterationOutcome::Slow { change: change / size, iterations: self.count };
            }
            self.ratio = ratio;
        }
        self.before = change;
        IterationOutcome::Continue
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The iteration of changes that decrease by a factor: the number of changes until it ends.
    fn count(tolerance: f64, factor: f64) -> i32 {
        let mut iteration = FixedPointIteration::until(1.0, 0.25).with_tolerance(tolerance);
        (1..=MAX_ITERATIONS as i32).find(|k| iteration.assess(factor.powi(*k), 1.0) == IterationOutcome::Done).unwrap()
    }

    /// What remains after k changes is `factor^(k + 1) / (1 - factor)`. The iteration ends as soon as this is at most the
    /// tolerance, and not before its factor is known from two changes; the first factor counts as 0.1 at least.
    #[test]
    fn the_remaining_error_is_at_most_the_tolerance() {
        for factor in [0.01_f64, 0.1, 0.3, 0.5] {
            for tolerance in [1e-3, 1e-6, 1e-9, 1e-12] {
                let remaining = |k: i32| factor.powi(k + 1) / (1.0 - factor);
                let k = count(tolerance, factor);
                // The powers have a few roundings each.
                let tolerance = [1.0 - 1e-12, 1.0 + 1e-12].map(|x| x * tolerance);
                assert!(remaining(k) <= tolerance[1], "{factor}, {tolerance:?}: {k}");
                assert!(k <= 3 || remaining(k - 1) > tolerance[0], "{factor}, {tolerance:?}: {k}");
            }
        }
    }
}
