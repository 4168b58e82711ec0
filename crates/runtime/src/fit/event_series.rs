//! Times of events as observed quantities of a fit.

use super::SignChanges;
use super::model::{FitModel, Quantity, undefined};
use crate::{Crossing, EventAt, Motion, RunMonitor, RuntimeError, StepControl, System};
use discrete_herglotz::Steps;
use herglotz_fit::ModelFailure;
use std::ops::ControlFlow;

/// The part of the span by which sign changes may be later than those that were measured, for values of the unknowns that are
/// not yet fitted.
pub(super) const LATER: f64 = 0.5;

/// The least number of steps up to the last of the data: a step in which resets accumulate is lost as a whole, with the sign
/// changes in it.
pub(super) const LEAST_STEPS: f64 = 64.0;

/// Makes the steps of a motion at most as long as this.
pub(super) fn shorten(motion: &mut Motion, most: f64) {
    if let StepControl::Steps { steps: Steps::Size(size), .. } = &mut motion.step_control {
        *size = size.min(most);
    }
}

/// A sign change of an event: the index of the event, and the number of the sign change in the order of the motion.
#[derive(Clone, Copy)]
pub(super) struct SignChange {
    pub event: usize,
    pub number: usize,
}

/// The quantity of a series of times of an event.
pub(super) fn event_time(motion: &Motion, of: &SignChanges) -> Result<Quantity, RuntimeError> {
    let count = motion.events.len();
    if of.event >= count {
        let why = format!("are those of the event {}, but the motion has {count}", of.event);
        return Err(RuntimeError::argument("times", why));
    }
    Ok(Quantity::EventTime(of.event))
}

/// Keeps the sign changes of events, and ends the motion when it has all that are wanted.
struct Kept<'a> {
    wanted: &'a [SignChange],
    /// The times of each event.
    times: Vec<Vec<f64>>,
    monitor: &'a mut dyn RunMonitor,
    is_interrupted: bool,
}

impl Kept<'_> {
    fn time(&self, of: &SignChange) -> Option<f64> {
        self.times.get(of.event)?.get(of.number).copied()
    }
}

impl RunMonitor for Kept<'_> {
    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        if let Some(times) = self.times.get_mut(crossing.event) {
            times.push(crossing.t);
        }
        match self.wanted.iter().all(|of| self.time(of).is_some()) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    fn poll(&mut self, part: f64) -> ControlFlow<()> {
        let found = self.monitor.poll(part);
        self.is_interrupted |= found.is_break();
        found
    }
}

impl FitModel<'_> {
    /// The sign changes that are wanted, of a motion of a system with these values of the unknowns.
    pub(super) fn crossings(
        &self,
        system: &System,
        motion: &Motion,
        wanted: &[SignChange],
    ) -> Result<Vec<EventAt>, ModelFailure> {
        let times = vec![Vec::new(); motion.events.len()];
        let mut kept = Kept { wanted, times, monitor: &mut **self.monitor.borrow_mut(), is_interrupted: false };
        let outcome = system.kernel.run(motion, &mut kept, None).map_err(undefined)?;
        if kept.is_interrupted {
            self.is_interrupted.set(true);
            return Err(undefined(outcome.status));
        }
        let of = |of: &SignChange| match kept.time(of) {
            Some(t) => Ok(EventAt { event: of.event, t }),
            None => {
                let (count, end) = (kept.times.get(of.event).map_or(0, Vec::len), outcome.t);
                let what = format!(
                    "the event {} has {count} sign changes up to t = {end}, and the data have one with the number {}; \
                     start nearer to the fit",
                    of.event,
                    of.number + 1
                );
                Err(ModelFailure::Undefined(what))
            }
        };
        wanted.iter().map(of).collect()
    }
}
