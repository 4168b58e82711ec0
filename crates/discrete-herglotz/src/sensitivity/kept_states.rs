//! States kept along a run, from which its steps are taken again.

use crate::run::{Observer, OutputRequest, StepView, Stop};
use crate::{StepError, Stepper};
use std::ops::{ControlFlow, Range};

/// The number of steps whose stages are in memory at once.
pub(crate) const BLOCK: usize = 64;

/// The largest number of states that are kept.
const MAX_KEPT: usize = 512;

/// Keeps the state of the stepper at multiples of an interval of steps. The interval is doubled when there are
/// too many states, so that the memory is bounded for any number of steps.
pub(crate) struct KeptStates {
    interval: usize,
    /// The saved words of the stepper after `interval * i` steps.
    states: Vec<Vec<u64>>,
    /// The number of steps taken.
    taken: usize,
}

impl KeptStates {
    pub fn new() -> Self {
        KeptStates { interval: BLOCK, states: Vec::new(), taken: 0 }
    }

    /// The intervals of steps between kept states, each with the state at its start, from the last to the first.
    pub fn backward(&self) -> impl Iterator<Item = (Range<usize>, &[u64])> {
        let steps = move |i: usize| i * self.interval..((i + 1) * self.interval).min(self.taken);
        self.states
            .iter()
            .enumerate()
            .rev()
            .map(move |(i, words)| (steps(i), words.as_slice()))
            .filter(|(r, _)| !r.is_empty())
    }

    fn keep(&mut self, at: &StepView<'_>) {
        self.taken = at.k;
        if !at.k.is_multiple_of(self.interval) || at.k != self.states.len() * self.interval {
            return;
        }
        let Some(words) = at.stepper.save() else { return };
        self.states.push(words);
        if self.states.len() > MAX_KEPT {
            let mut kept = false;
            self.states.retain(|_| {
                kept = !kept;
                kept
            });
            self.interval *= 2;
        }
    }
}

impl Observer for KeptStates {
    fn needs(&self) -> OutputRequest {
        OutputRequest { saved: true, ..OutputRequest::ACTION }
    }

    fn next(&self, taken: usize) -> usize {
        (taken / self.interval + 1) * self.interval
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.keep(at);
        ControlFlow::Continue(())
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.keep(at);
        ControlFlow::Continue(())
    }
}

/// Takes the steps of an interval again, in blocks from the last to the first, and calls a function with the stepper at
/// the start of each block. An interval of many blocks is halved, so that the number of states in memory grows like the
/// logarithm of its length.
pub(crate) fn for_each_block<E>(
    stepper: &mut dyn Stepper,
    steps: Range<usize>,
    words: &[u64],
    work: &mut impl FnMut(&mut dyn Stepper, Range<usize>) -> Result<(), E>,
    fail: &impl Fn(usize, StepError) -> E,
) -> Result<(), E> {
    if !stepper.restore(words) {
        return Err(fail(steps.start, StepError::NonFinite));
    }
    if steps.len() <= BLOCK {
        return work(stepper, steps);
    }
    let first = (steps.len() / 2).div_ceil(BLOCK) * BLOCK;
    let middle = steps.start + first;
    stepper.advance(first).map_err(|failure| fail(steps.start + failure.taken, failure.cause))?;
    let Some(saved) = stepper.save() else { return Err(fail(middle, StepError::NonFinite)) };
    for_each_block(stepper, middle..steps.end, &saved, work, fail)?;
    for_each_block(stepper, steps.start..middle, words, work, fail)
}
