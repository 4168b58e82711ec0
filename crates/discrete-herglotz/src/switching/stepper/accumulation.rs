//! Resets at ever shorter intervals.

use crate::numbers::state_words::saved;

/// The time to the limit of the resets below which they are not followed any further, as a fraction of a step: the
/// limit is then known to more digits than the error of a step.
const MIN_REMAINING_TIME: f64 = 1e-10;

/// The same in units of the round-off of the time, in which shorter intervals have no digits.
const MIN_REMAINING_ROUNDINGS: f64 = 64.0;

/// The last resets at one surface, whose times may have a limit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Accumulation {
    /// The index of the surface.
    pub index: usize,
    /// The times of the last three resets, the latest last; NaN before the first ones.
    pub times: [f64; 3],
}

impl Default for Accumulation {
    fn default() -> Self {
        Accumulation { index: 0, times: [f64::NAN; 3] }
    }
}

impl Accumulation {
    /// The time between the last two resets at one surface; infinite if there were none.
    pub fn last_interval(&self) -> f64 {
        let [_, second, third] = self.times;
        let interval = (third - second).abs();
        if interval > 0.0 { interval } else { f64::INFINITY }
    }

    /// Adds a reset; returns the limit of the times, if the intervals decrease like a geometric sequence and the rest of
    /// them is shorter than the smallest times of interest of a step of length h. `spacing` is the round-off of the
    /// time.
    pub fn add(&mut self, index: usize, t: f64, h: f64, spacing: f64) -> Option<f64> {
        let [_, second, third] = if index == self.index { self.times } else { [f64::NAN; 3] };
        *self = Accumulation { index, times: [second, third, t] };
        let [first, second, third] = self.times;
        let (before, last) = (second - first, third - second);
        let ratio = last / before;
        let remaining = last * ratio / (1.0 - ratio);
        let shortest = (MIN_REMAINING_TIME * h.abs()).max(MIN_REMAINING_ROUNDINGS * spacing);
        // Written so that NaN is no limit.
        ((0.0..1.0).contains(&ratio) && remaining.abs() <= shortest).then_some(t + remaining)
    }
}

saved!([] Accumulation { index, times });
