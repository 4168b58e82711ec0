//! What is known of a step that was taken: its stages, or its ends.

use crate::integration::SolvedStages;
use crate::{State, Vector};

/// The ends of a step.
#[derive(Clone, Debug)]
pub(crate) struct StepEnds {
    pub t: f64,
    pub h: f64,
    pub start: State,
    pub end: State,
}

/// A step, or a part of one, that nothing interrupts.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a box would be an allocation in each step")]
pub(crate) enum WholeStep {
    /// The stages of a collocation step.
    Collocation(SolvedStages),
    /// The ends of a step that consists of sub-flows.
    Flow(StepEnds),
}

impl WholeStep {
    /// The time and the state at the start.
    pub fn start(&self) -> (f64, &State) {
        match self {
            WholeStep::Collocation(step) => (step.t, &step.start),
            WholeStep::Flow(step) => (step.t, &step.start),
        }
    }

    /// The length.
    pub fn length(&self) -> f64 {
        match self {
            WholeStep::Collocation(step) => step.h,
            WholeStep::Flow(step) => step.h,
        }
    }

    /// A velocity within the step.
    pub fn velocity(&self) -> Vector {
        match self {
            WholeStep::Collocation(step) => step.v.iter().map(|v| v.0[0]).collect(),
            WholeStep::Flow(step) => (&step.end.q - &step.start.q) / step.h,
        }
    }
}
