//! What is kept along a run for its gradients: the stages of its steps, or states from which these are taken again.

use crate::integration::{SolvedStages, WholeStep};
use crate::run::{Observer, OutputRequest, RunInfo, StepView, Stop};
use crate::sensitivity::step_tangent::TakenStep;
use crate::{InputError, StepError, Stepper};
use std::ops::{ControlFlow, Range};

/// The number of steps whose stages are in memory at once.
pub(crate) const BLOCK: usize = 64;

/// The largest number of states that are kept.
const MAX_KEPT: usize = 512;

/// The most numbers that are kept of the stages of all steps: 32 MiB.
const MOST_NUMBERS: usize = 1 << 22;

/// Keeps the stages of collocation steps as long as they take little memory, and the state of the stepper at multiples of an
/// interval of steps. The interval is doubled when there are too many states, so that the memory is bounded for any number of
/// steps.
pub(crate) struct KeptStates {
    interval: usize,
    /// The saved words of the stepper after `interval * i` steps.
    states: Vec<Vec<u64>>,
    /// The number of steps taken.
    taken: usize,
    /// The expected number of steps, 0 if it is not known.
    expected: usize,
    stages: Option<KeptStages>,
}

/// The stages of the steps of a run.
#[derive(Default)]
pub(crate) struct KeptStages {
    /// The first step, whose kind all of them have.
    first: Option<SolvedStages>,
    numbers: Vec<f64>,
}

impl KeptStages {
    /// The number of numbers of a step.
    fn size(&self) -> usize {
        self.first.as_ref().map_or(1, |first| SolvedStages::size(first.s, first.start.q.len()))
    }

    fn count(&self) -> usize {
        self.numbers.len() / self.size()
    }

    /// Keeps a step of a run with an expected number of steps; `false` if it is of another kind than those before, or if there
    /// are too many.
    fn keep(&mut self, step: &SolvedStages, expected: usize) -> bool {
        let (s, n) = (step.s, step.start.q.len());
        let size = SolvedStages::size(s, n);
        let all = expected.saturating_mul(size).max(self.numbers.len() + size);
        let first = self.first.get_or_insert_with(|| step.clone());
        if all > MOST_NUMBERS || (first.s, first.start.q.len(), first.knows_l) != (s, n, step.knows_l) {
            return false;
        }
        self.numbers.reserve(all - self.numbers.len());
        step.append_to(&mut self.numbers);
        true
    }

    /// Calls a function with each step and its number, from the last to the first.
    ///
    /// # Errors
    /// Those of the function.
    pub fn for_each_backward<E>(&self, mut f: impl FnMut(usize, &TakenStep) -> Result<(), E>) -> Result<(), E> {
        let Some(first) = &self.first else { return Ok(()) };
        let mut step = TakenStep::Whole(WholeStep::Collocation(first.clone()));
        for (k, numbers) in self.numbers.chunks_exact(self.size()).enumerate().rev() {
            if let TakenStep::Whole(WholeStep::Collocation(stages)) = &mut step {
                stages.set(numbers);
            }
            f(k, &step)?;
        }
        Ok(())
    }
}

impl KeptStates {
    /// Nothing so far, with stages if the steps have some.
    pub fn new(has_stages: bool) -> Self {
        let stages = has_stages.then(KeptStages::default);
        KeptStates { interval: BLOCK, states: Vec::new(), taken: 0, expected: 0, stages }
    }

    /// The stages of all steps, if they were kept.
    pub fn stages(&self) -> Option<&KeptStages> {
        self.stages.as_ref().filter(|stages| stages.count() == self.taken)
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

    fn keep_stages(&mut self, at: &StepView<'_>) {
        let Some(stages) = &mut self.stages else { return };
        let step = at.stepper.solved_stages();
        if !step.as_ref().is_some_and(|step| stages.keep(step, self.expected)) {
            self.stages = None;
        }
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

    fn prepare(&mut self, info: &RunInfo) -> Result<(), InputError> {
        self.expected = info.count.unwrap_or(0);
        Ok(())
    }

    fn next(&self, taken: usize) -> usize {
        if self.stages.is_some() { taken + 1 } else { (taken / self.interval + 1) * self.interval }
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.keep(at);
        ControlFlow::Continue(())
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.keep_stages(at);
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
