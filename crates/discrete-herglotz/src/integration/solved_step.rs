//! What is known of a step that was taken: its stages, or its ends.

use crate::integration::SolvedStages;
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SVector;

/// The ends of a step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepEnds<const N: usize> {
    pub t: f64,
    pub h: f64,
    pub start: PhasePoint<N>,
    pub end: PhasePoint<N>,
}

/// A step, or a part of one, that nothing interrupts.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a box would be an allocation in each step")]
pub(crate) enum WholeStep<const N: usize> {
    /// The stages of a collocation step.
    Collocation(SolvedStages<N>),
    /// The ends of a step that consists of sub-flows.
    Flow(StepEnds<N>),
}

impl<const N: usize> WholeStep<N> {
    /// The time and the state at the start.
    pub fn start(&self) -> (f64, &PhasePoint<N>) {
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
    pub fn velocity(&self) -> SVector<f64, N> {
        match self {
            WholeStep::Collocation(step) => SVector::from_fn(|d, _| step.v[d].0[0]),
            WholeStep::Flow(step) => (step.end.q - step.start.q) / step.h,
        }
    }
}
