//! The times at which trial runs are compared.

use crate::run::accuracy::limits::COMPARED_PARTS;

/// The times of a span at which runs are compared.
#[derive(Clone, Debug)]
pub(crate) enum ComparisonGrid {
    /// Ends of steps of a run with `base` steps, which divides the numbers of steps of all others.
    Steps { base: usize, at: Vec<usize> },
    /// The ends of the tenths of a span, on which steps in transformed time are forced to end.
    Times,
}

impl ComparisonGrid {
    /// The ends of the tenths of a span, each moved to the end of the step that contains it; the ends of all steps if
    /// there are fewer than ten.
    pub fn of(base: usize) -> Self {
        let parts = base.min(COMPARED_PARTS);
        ComparisonGrid::Steps { base, at: (1..=parts).map(|i| (i * base).div_ceil(parts)).collect() }
    }

    /// Equal parts of a span: ten, or the number of steps if that is smaller.
    pub fn equal(steps: usize) -> Self {
        ComparisonGrid::of(steps.min(COMPARED_PARTS))
    }

    /// The number of steps that divides those of all runs.
    pub fn base(&self) -> usize {
        if let ComparisonGrid::Steps { base, .. } = self { *base } else { 1 }
    }

    /// The smallest number of steps, not below `steps`, that the grid divides.
    pub fn whole(&self, steps: f64) -> usize {
        let base = self.base();
        (steps / base as f64).ceil().max(1.0) as usize * base
    }

    /// The number of steps and the time at the i-th point of the grid, for a run with `count` steps over a span: the
    /// run stops at whichever it reaches first.
    pub fn stop(&self, i: usize, count: usize, t0: f64, span: f64) -> Option<(usize, f64)> {
        match self {
            ComparisonGrid::Steps { base, at } => {
                at.get(i).map(|step| (step * (count / base), f64::INFINITY.copysign(span)))
            }
            ComparisonGrid::Times => {
                (i < COMPARED_PARTS).then(|| (usize::MAX, t0 + span * ((i + 1) as f64 / COMPARED_PARTS as f64)))
            }
        }
    }
}
