//! The times of rows within a run.

use crate::InputError;
use crate::run::RunInfo;
use contact_geom::numbers::max_or_nan;

/// The round-off of the ends of the steps of a run, relative to the largest of its times: they are sums of the start and of
/// a multiple of the step size, which are rounded, also where they cancel.
const ROUND_OFF: f64 = 4.0 * f64::EPSILON;

/// Whether times are those of ends of steps, up to round-off.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SameTime {
    round_off: f64,
}

impl SameTime {
    /// For a run between two times.
    pub fn of_span((t0, t_end): (f64, f64)) -> Self {
        SameTime { round_off: ROUND_OFF * max_or_nan(t0.abs(), t_end.abs()) }
    }

    /// Whether a time is that of a step's end.
    pub fn is(self, t: f64, end: f64) -> bool {
        (t - end).abs() <= self.round_off
    }
}

/// The times of rows, in the order of the run.
pub(crate) struct RowTimes {
    times: Vec<f64>,
    passed: usize,
    same: SameTime,
}

impl RowTimes {
    /// The times of rows of a run between two times.
    pub fn new(times: &[f64], span: (f64, f64)) -> Self {
        RowTimes { times: times.to_vec(), passed: 0, same: SameTime::of_span(span) }
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
        if self.same.is(t, end) || passed {
            return None;
        }
        self.passed += 1;
        Some(t)
    }

    /// The next time, if it is that of the end of a step.
    pub fn next_at(&mut self, end: f64, last: bool) -> Option<f64> {
        let t = *self.times.get(self.passed)?;
        if !(last || self.same.is(t, end)) {
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
