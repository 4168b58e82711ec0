//! Tests of splittings against an independent reference and against the theory.

mod discrete_lagrangians;
mod hypotheses;
mod orders;
mod steps;

use super::{
    ActionFlow, ActionMap, ActionSplitting, ActionStrang, Riccati, RiccatiMap, Splitting, Strang, action_flow,
};
use crate::{InputError, SplittingScheme, Stepper};
use contact_geom::{ChartVector, PhasePoint, numbers::MaxAbsOrNan};

type Outcome = Result<(), InputError>;

fn distance<const N: usize>(a: PhasePoint<N>, b: PhasePoint<N>) -> f64 {
    ChartVector::from(a).minus(ChartVector::from(b)).max_abs_or_nan()
}

/// The state after this number of steps.
fn run<const N: usize>(mut motion: impl Stepper, steps: usize) -> PhasePoint<N> {
    assert_eq!(motion.advance(steps), Ok(()));
    motion.state().fixed()
}

static SCHEMES: [SplittingScheme; 15] = SplittingScheme::ALL;
