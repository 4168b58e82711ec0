//! What is requested of a run: its span, its steps, its integrator and its outputs.

use crate::run::observers::observer::Terminal;
use crate::run::observers::output_request::OutputRequest;
use crate::{InputError, Integrator, Problem};
use contact_geom::nalgebra::SVector;
use std::sync::Arc;

/// The time steps of a run. They go back in time where the run does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Steps {
    /// Steps of this length, made a little shorter so that a whole number of them fills the span; of an integrator in transformed time, steps
    /// of this length in the transformed time, the last one shorter.
    Size(f64),
    /// This many steps; not in transformed time, which counts them itself.
    Count(usize),
}

/// Where a run ends, if no observer ends it before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Until {
    /// At this time, before or after that of the start, or there: then the start is all that is seen.
    Time(f64),
    /// After this time, negative to go back.
    After(f64),
    /// After so many steps of the [size](Steps::Size) that is given; a negative size goes back.
    Steps(usize),
}

/// An integrator for as long as the Lagrangian lives.
pub(crate) type Shared<'p, L, const N: usize> = Arc<dyn Integrator<'p, L, N> + 'p>;

/// How a step is chosen for an accuracy: in a program that asks for none it is not compiled.
pub(crate) type ChooseSteps<'p, L, const N: usize> =
    for<'e> fn(&Request<'p, L, N>, f64, Option<Terminal<'e, N>>) -> Result<StepSelection<'p, L, N>, InputError>;

/// How long the steps of a run are to be.
pub(crate) enum StepControl<'p, L, const N: usize> {
    Given(Steps),
    /// So many steps of this length exactly.
    Exactly(usize, f64),
    For(f64, ChooseSteps<'p, L, N>),
}

impl<L, const N: usize> Clone for StepControl<'_, L, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L, const N: usize> Copy for StepControl<'_, L, N> {}

/// What is asked of a run, without its observers.
pub(crate) struct Request<'p, L, const N: usize> {
    pub problem: &'p Problem<'p, L, N>,
    pub t_end: f64,
    pub span: f64,
    pub integrator: Option<Shared<'p, L, N>>,
    pub needs: OutputRequest,
    /// What the errors of the coordinates are measured by, where that is given.
    pub scales: Option<SVector<f64, N>>,
}

/// What is chosen for a run.
pub(crate) struct StepSelection<'p, L, const N: usize> {
    pub integrator: Shared<'p, L, N>,
    pub count: usize,
    /// The length of a step; in transformed time, in its time.
    pub h: f64,
    /// The error that the trial runs found, or predict; `None` where the steps are given.
    pub error: Option<f64>,
    /// The steps after which an observer is to end the run, where they go on beyond.
    pub ended: Option<usize>,
}

impl<L, const N: usize> Clone for StepSelection<'_, L, N> {
    fn clone(&self) -> Self {
        StepSelection { integrator: self.integrator.clone(), ..*self }
    }
}

/// The largest number of steps: `t0 + k h` then still tells times a thousandth of a step apart.
pub(crate) const MOST_STEPS: f64 = (1u64 << 42) as f64;
