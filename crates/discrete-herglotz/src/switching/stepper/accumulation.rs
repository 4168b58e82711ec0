//! Resets at ever shorter intervals.

use crate::numbers::state_words::saved;

/// The time to the limit of the resets below which they are not followed any further, as a fraction of a step: the
/// limit is then known to more digits than the error of a step.
const MIN_REMAINING_TIME: f64 = 1e-10;

/// The same in units of the round-off of the time, in which shorter intervals have no digits.
const MIN_REMAINING_ROUNDINGS: f64 = 64.0;

/// The height of a flight over its surface below which it is not followed any further, in units of the round-off of the
/// switching function. The times of shorter flights have larger errors from the round-off than the limit of the geometric
/// sequence has from the change of the ratio.
const MIN_HEIGHT_ROUNDINGS: f64 = 1e5;

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

    /// Adds a reset; returns the limit of the times, if the intervals decrease like a geometric sequence and the flights
    /// between them are too short to be followed. A second reset at the same time is such a flight.
    pub fn add(&mut self, index: usize, t: f64, resolution: &Resolution) -> Option<f64> {
        let [_, second, third] = if index == self.index { self.times } else { [f64::NAN; 3] };
        *self = Accumulation { index, times: [second, third, t] };
        let [first, second, third] = self.times;
        let (before, last) = (second - first, third - second);
        if last == 0.0 {
            return Some(t);
        }
        let ratio = last / before;
        let remaining = last * ratio / (1.0 - ratio);
        let Resolution { h, spacing, rate, rounding } = *resolution;
        let shortest = (MIN_REMAINING_TIME * h.abs()).max(MIN_REMAINING_ROUNDINGS * spacing);
        // A flight under a constant acceleration reaches a quarter of its time times its initial rate.
        let height = 0.25 * (last * ratio * rate).abs();
        let is_low = rate != 0.0 && height <= MIN_HEIGHT_ROUNDINGS * rounding && remaining.abs() <= h.abs();
        let is_short = remaining.abs() <= shortest || is_low;
        // Written so that NaN is no limit.
        ((0.0..1.0).contains(&ratio) && is_short).then_some(t + remaining)
    }
}

/// What can be resolved of a flight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Resolution {
    /// The length of a step.
    pub h: f64,
    /// The round-off of the time.
    pub spacing: f64,
    /// The rate of the switching function after the reset.
    pub rate: f64,
    /// The round-off of the switching function.
    pub rounding: f64,
}

saved!([] Accumulation { index, times });
