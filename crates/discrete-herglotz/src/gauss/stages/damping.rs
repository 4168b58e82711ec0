//! Damped Newton iteration for the stages of a step: the choice of the damping factor, and the detection of failure.

use crate::gauss::limits::{DAMPING_FACTOR, EXPENSIVE_FACTORISATION, MAX_CONTRACTION, MIN_DECREASE};

/// The number of corrections that may be taken although they fail the test: one for a small number of unknowns, where a
/// factorisation is inexpensive.
pub(crate) fn chances(unknowns: usize) -> u32 {
    u32::from(unknowns < EXPENSIVE_FACTORISATION)
}

/// The decision on a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Verdict {
    Taken,
    /// Try another damping factor ([`part`](Damping::part)) of the same correction.
    Again,
    GivenUp,
}

/// The damping of the Newton corrections of one step.
///
/// A correction is accepted if the next one, with the same Jacobian, is smaller: the natural monotonicity test, which
/// does not depend on the scaling of the residuals; see Deuflhard, "Newton Methods for Nonlinear Problems" (2004). If
/// neither the full nor the damped correction passes the test, the iteration fails, except for the first `chances`
/// failures, where the full correction is taken. Steps that are too long for the motion have no solution, or one that
/// is found only by chance.
pub(crate) struct Damping {
    part: f64,
    /// The number of corrections that may still be taken although they fail the test.
    chances: u32,
    /// Whether the current correction is one of these.
    regardless: bool,
    ratio: f64,
}

impl Damping {
    /// A new iteration, with the number of corrections that may be taken although they fail the test.
    pub fn new(chances: u32) -> Self {
        Damping { part: 1.0, chances, regardless: false, ratio: 1.0 }
    }

    /// The damping factor of the next trial.
    pub fn part(&self) -> f64 {
        self.part
    }

    /// Whether the next correction needs a new Jacobian; if not, it is the one that the last trial has computed.
    pub fn renews(&self) -> bool {
        self.ratio > MAX_CONTRACTION
    }

    /// The size of the next correction divided by that of the last; 1 if the last correction was damped.
    pub fn ratio(&self) -> f64 {
        self.ratio
    }

    /// Decides on a trial from the sizes of its correction and of the next one; corrections below `near` are always
    /// accepted.
    pub fn judge(&mut self, correction: f64, next: f64, near: f64) -> Verdict {
        let smaller = next <= (1.0 - MIN_DECREASE * self.part) * correction;
        let regardless = (self.regardless || correction <= near) && next.is_finite();
        if smaller || regardless {
            self.ratio = match self.part {
                1.0 if correction > 0.0 => next / correction,
                1.0 => 0.0,
                _ => 1.0,
            };
            (self.part, self.regardless) = (1.0, false);
            return Verdict::Taken;
        }
        if !self.regardless && self.part == 1.0 {
            self.part = DAMPING_FACTOR;
        } else if !self.regardless && self.chances > 0 {
            self.chances -= 1;
            (self.part, self.regardless) = (1.0, true);
        } else {
            return Verdict::GivenUp;
        }
        Verdict::Again
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gauss::limits::MAX_NEWTON_ITERATIONS;

    /// The damped iteration for `f(x) = 0`: the number of trials, and the root if it converges.
    fn follow(f: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64, mut x: f64, chances: u32) -> (u32, Option<f64>) {
        let (mut damping, mut trials) = (Damping::new(chances), 0);
        for _ in 0..MAX_NEWTON_ITERATIONS {
            let slope = slope(x);
            let correction = -f(x) / slope;
            x = loop {
                let trial = x + damping.part() * correction;
                let next = -f(trial) / slope;
                trials += 1;
                match damping.judge(correction.abs(), next.abs(), 0.0) {
                    Verdict::Taken => break trial,
                    Verdict::Again => {}
                    Verdict::GivenUp => return (trials, None),
                }
            };
            if f(x).abs() <= 1e-14 {
                return (trials, Some(x));
            }
        }
        (trials, None)
    }

    #[test]
    fn a_correction_that_goes_too_far_is_taken_in_part() {
        let (trials, x) = follow(f64::atan, |x| 1.0 / (1.0 + x * x), 2.0, 1);
        assert!(x.is_some_and(|x| x.abs() <= 1e-14) && trials <= 10, "{trials}: {x:?}");
    }

    /// `x^2 + 1` has no root, and the second function is not defined at its first iterate.
    #[test]
    fn what_has_no_root_is_given_up() {
        for chances in [chances(EXPENSIVE_FACTORISATION), chances(1)] {
            for start in [0.3, 2.0, 1e3] {
                let (trials, x) = follow(|x| x * x + 1.0, |x| 2.0 * x, start, chances);
                assert!(x.is_none() && trials <= 60, "{trials} from {start}: {x:?}");
            }
            let (trials, x) = follow(|x| if x == 1.0 { 1.0 } else { f64::NAN }, |_| 1.0, 1.0, chances);
            assert!(x.is_none() && trials <= 6, "{trials}: {x:?}");
        }
    }
}
