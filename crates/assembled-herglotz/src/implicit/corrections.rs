//! When Newton's method with kept factors is done, and when new factors are worth their price.

/// The most iterations with kept factors that are worth one factorisation.
const PATIENCE: f64 = 6.0;

/// The corrections of one solution so far.
pub(crate) struct Corrections {
    last: f64,
}

/// What to do after a correction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// What is left is round-off.
    Done,
    /// Go on with the same factors.
    Further,
    /// Go on with new ones.
    Factorise,
}

impl Corrections {
    pub fn new() -> Self {
        Corrections { last: f64::INFINITY }
    }

    /// After new factors the last correction tells nothing of the next.
    pub fn forget(&mut self) {
        self.last = f64::INFINITY;
    }

    /// Judges a correction of this size, where those below `round_off` change nothing.
    pub fn judge(&mut self, now: f64, round_off: f64) -> Verdict {
        if now <= round_off * f64::EPSILON {
            return Verdict::Done;
        }
        let mut verdict = Verdict::Further;
        // The first correction tells nothing of the next.
        if self.last.is_finite() {
            let rate = now / self.last;
            let next = if rate < 1.0 { now * rate / (1.0 - rate) } else { f64::INFINITY };
            // What round-off leaves of the residual comes back at each solve.
            if next <= round_off || rate >= 0.5 && now <= 8.0 * round_off {
                return Verdict::Done;
            }
            // The solves that are left at this rate; new factors are worth their price where those are many.
            let left = (round_off / now).ln() / rate.min(1.0).ln();
            if left.is_nan() || left > PATIENCE {
                verdict = Verdict::Factorise;
            }
        }
        self.last = now;
        verdict
    }
}
