//! The times of rows within a run.

use crate::InputError;
use crate::run::RunInfo;

/// A distance in time that is round-off, relative to the time and to the step.
const SAME_TIME: f64 = 4.0 * f64::EPSILON;

/// Whether a time is that of a step's end, up to round-off.
pub(crate) fn is_same_time(t: f64, end: f64) -> bool {
    (t - end).abs() <= SAME_TIME * end.abs().max(t.abs())
}

/// The times of rows, in the order of the run.
pub(crate) struct RowTimes {
    times: Vec<f64>,
    passed: usize,
}

impl RowTimes {
    pub fn new(times: &[f64]) -> Self {
        RowTimes { times: times.to_vec(), passed: 0 }
    }

    /// Checks the times for a run.
    ///
    /// # Errors
    /// [`InputError::Times`] with the first time that is not in order, or outside of the span.
    pub fn check(&self, info: &RunInfo) -> Result<(), InputError> {
        check_times(&self.times, (info.t0, info.t_end))
    }

    /// The next time inside of the step, before its end.
    pub fn next_within(&mut self, (start, end): (f64, f64)) -> Option<f64> {
        let t = *self.times.get(self.passed)?;
        let passed = if end < start { t <= end } else { t >= end };
        if is_same_time(t, end) || passed {
            return None;
        }
        self.passed += 1;
        Some(t)
    }

    /// The next time, if it is that of the end of a step.
    pub fn next_at(&mut self, end: f64, last: bool) -> Option<f64> {
        let t = *self.times.get(self.passed)?;
        if !(last || is_same_time(t, end)) {
            return None;
        }
        self.passed += 1;
        Some(t)
    }
}

/// Checks that times are in the order of a run, and in its span.
pub(crate) fn check_times(times: &[f64], (t0, t_end): (f64, f64)) -> Result<(), InputError> {
    let inside = |t: f64| (t0.min(t_end)..=t0.max(t_end)).contains(&t);
    let in_order = |i: usize| i == 0 || if t_end < t0 { times[i] < times[i - 1] } else { times[i] > times[i - 1] };
    match times.iter().enumerate().position(|(i, t)| !inside(*t) || !in_order(i)) {
        Some(index) => Err(InputError::Times { index, t: times[index] }),
        None => Ok(()),
    }
}
