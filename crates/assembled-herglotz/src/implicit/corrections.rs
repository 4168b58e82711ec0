//! The stopping criterion of Newton's method with kept factors, and the decision to factorise anew.

/// New factors are computed if more than this number of further iterations is expected; fewer iterations are less
/// expensive than a factorisation.
const PATIENCE: f64 = 6.0;

/// The convergence history of one solution by Newton's method.
pub(crate) struct Corrections {
    last: f64,
}

/// The decision after a correction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// The remaining error is round-off.
    Done,
    /// Continue with the same factors.
    Further,
    /// Continue with new factors.
    Factorise,
}

impl Corrections {
    pub fn new() -> Self {
        Corrections { last: f64::INFINITY }
    }

    /// Discards the last correction, since with new factors the rate of convergence changes.
    pub fn forget(&mut self) {
        self.last = f64::INFINITY;
    }

    /// Judges a correction of size `now`, where corrections below `round_off` do not change the result.
    pub fn judge(&mut self, now: f64, round_off: f64) -> Verdict {
        if now <= round_off * f64::EPSILON {
            return Verdict::Done;
        }
        let mut verdict = Verdict::Further;
        // The rate of convergence is known from the second correction on.
        if self.last.is_finite() {
            let rate = now / self.last;
            let next = if rate < 1.0 { now * rate / (1.0 - rate) } else { f64::INFINITY };
            // Round-off in the residual causes corrections that no longer decrease.
            if next <= round_off || rate >= 0.5 && now <= 8.0 * round_off {
                return Verdict::Done;
            }
            // The number of further solves at this rate. If there are many, new factors are less expensive.
            let left = (round_off / now).ln() / rate.min(1.0).ln();
            if left.is_nan() || left > PATIENCE {
                verdict = Verdict::Factorise;
            }
        }
        self.last = now;
        verdict
    }
}
