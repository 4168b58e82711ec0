//! The stopping criterion of Newton's method with kept factors, and the decision to factorise anew.

/// New factors are computed if more than this number of further iterations is expected; fewer iterations are less
/// expensive than a factorisation.
const MAX_EXPECTED_ITERATIONS: f64 = 6.0;

/// The ratio of successive corrections from which on they are considered as no longer decreasing.
const STAGNATION_RATE: f64 = 0.5;

/// Corrections that no longer decrease are round-off if they are below this number of round-off units: the residual has
/// several terms of the size of the largest, each with its own rounding error.
const STAGNATION_ROUND_OFFS: f64 = 8.0;

/// The convergence history of one solution by Newton's method.
pub(crate) struct NewtonConvergence {
    last: f64,
    max_expected: f64,
}

/// The decision after a correction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NewtonDecision {
    /// The remaining error is round-off.
    Converged,
    /// Continue with the same factors.
    Continue,
    /// Continue with new factors.
    Refactorise,
}

impl NewtonConvergence {
    pub fn new() -> Self {
        Self::expecting(MAX_EXPECTED_ITERATIONS)
    }

    /// The history of a solution for which new factors are computed if more than this number of further iterations is
    /// expected.
    pub fn expecting(max_expected: f64) -> Self {
        NewtonConvergence { last: f64::INFINITY, max_expected }
    }

    /// Discards the last correction, since with new factors the rate of convergence changes.
    pub fn restart(&mut self) {
        self.last = f64::INFINITY;
    }

    /// Decides after a correction of the given size, where corrections below `round_off` do not change the result.
    pub fn decide(&mut self, correction: f64, round_off: f64) -> NewtonDecision {
        if correction <= round_off * f64::EPSILON {
            return NewtonDecision::Converged;
        }
        let mut decision = NewtonDecision::Continue;
        // The rate of convergence is known from the second correction on.
        if self.last.is_finite() {
            let rate = correction / self.last;
            let next = if rate < 1.0 { correction * rate / (1.0 - rate) } else { f64::INFINITY };
            // Round-off in the residual causes corrections that no longer decrease.
            let stagnates = rate >= STAGNATION_RATE && correction <= STAGNATION_ROUND_OFFS * round_off;
            if next <= round_off || stagnates {
                return NewtonDecision::Converged;
            }
            // The number of further iterations at this rate.
            let remaining = (round_off / correction).ln() / rate.min(1.0).ln();
            if remaining.is_nan() || remaining > self.max_expected {
                decision = NewtonDecision::Refactorise;
            }
        }
        self.last = correction;
        decision
    }
}
