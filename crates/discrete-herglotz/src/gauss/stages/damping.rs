//! Damped Newton iteration for the stages of a step: how much of a correction is taken, and when there is no hope.

/// The iterations that a step may take: three times as many as one needs whose forces grow like a third power.
pub(crate) const ITERATIONS: u32 = 24;

/// The part of a correction that is tried where the whole does not help. Smaller ones find few solutions more, and each of them costs
/// an evaluation.
const SHORT: f64 = 0.3;

/// The part by which the next correction must fall where this one is taken whole.
const GAIN: f64 = 0.25;

/// The ratio of two corrections above which the Jacobian is taken anew: an iteration with the old one costs a tenth of it or less.
const CONTRACTION: f64 = 0.2;

/// The unknowns from which on a factorisation costs more than a step that contracts.
const DEAR: usize = 16;

/// The corrections of which no part helps that are taken nevertheless: one, where it is cheap.
pub(crate) fn chances(unknowns: usize) -> u32 {
    u32::from(unknowns < DEAR)
}

/// What is to be done with a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Verdict {
    Taken,
    /// Another [`part`](Damping::part) of the same correction.
    Again,
    GivenUp,
}

/// The corrections of one step.
///
/// A correction is taken as far as the next one, with the same Jacobian, is smaller: the natural test of monotonicity, which needs no
/// scales of the residuals; see Deuflhard, "Newton Methods for Nonlinear Problems" (2004). Where neither the whole nor a part passes
/// it the iteration is given up, but for some chances: steps too long for the motion have no solution, or one that is found by
/// chance alone.
pub(crate) struct Damping {
    part: f64,
    /// Corrections that may still be taken though no part of them passes the test.
    chances: u32,
    /// Whether the correction that is tried is one of these.
    regardless: bool,
    ratio: f64,
}

impl Damping {
    /// With the corrections that may be taken though they do not pass the test.
    pub fn new(chances: u32) -> Self {
        Damping { part: 1.0, chances, regardless: false, ratio: 1.0 }
    }

    /// The part of the correction that is to be tried.
    pub fn part(&self) -> f64 {
        self.part
    }

    /// Whether the next correction asks for a new Jacobian; else it is the one that the last trial found.
    pub fn renews(&self) -> bool {
        self.ratio > CONTRACTION
    }

    /// The size of the next correction over that of the last, 1 where that was not taken whole.
    pub fn ratio(&self) -> f64 {
        self.ratio
    }

    /// Judges a trial by the sizes of its correction and of the next; below `near` all are taken.
    pub fn judge(&mut self, correction: f64, next: f64, near: f64) -> Verdict {
        let smaller = next <= (1.0 - GAIN * self.part) * correction;
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
            self.part = SHORT;
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

    /// The iteration of `arctan x = 0` from where Newton's method goes to infinity, and of `x^2 + 1 = 0`, which has no root: the trials
    /// that it takes, and where it ends.
    fn follow(f: impl Fn(f64) -> f64, slope: impl Fn(f64) -> f64, mut x: f64, chances: u32) -> (u32, Option<f64>) {
        let (mut damping, mut trials) = (Damping::new(chances), 0);
        for _ in 0..ITERATIONS {
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

    /// Without a chance and with one, and from where the function is not defined.
    #[test]
    fn what_has_no_root_is_given_up() {
        for chances in [chances(DEAR), chances(1)] {
            for start in [0.3, 2.0, 1e3] {
                let (trials, x) = follow(|x| x * x + 1.0, |x| 2.0 * x, start, chances);
                assert!(x.is_none() && trials <= 60, "{trials} from {start}: {x:?}");
            }
            let (trials, x) = follow(|x| if x == 1.0 { 1.0 } else { f64::NAN }, |_| 1.0, 1.0, chances);
            assert!(x.is_none() && trials <= 6, "{trials}: {x:?}");
        }
    }
}
