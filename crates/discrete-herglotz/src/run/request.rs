//! The request of a run: its span, its steps, its integrator and its outputs.

use crate::integration::{SharedIntegrator, SystemProblem};
use crate::run::observers::observer::Terminal;
use crate::run::observers::output_request::OutputRequest;
use crate::switching::Collocation;
use crate::{InputError, Stepper, Vector};

/// The time steps of a run. If the run goes backward in time, so do its steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Steps {
    /// Steps of this size, reduced so that a whole number of them fills the span. For an integrator in transformed
    /// time, steps of this size in that time; the last step is shorter.
    Size(f64),
    /// This number of steps. Not available in transformed time, where the number of steps results from the integration.
    Count(usize),
}

/// The end of a run, unless an observer ends it earlier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Until {
    /// At this time, before or after the start time. If it is the start time, observers see the start only.
    Time(f64),
    /// After this duration; negative for a run backward in time.
    After(f64),
    /// After this number of steps of the given [size](Steps::Size); a negative size gives a run backward in time.
    Steps(usize),
}

/// The step-size selection for an accuracy, as a function pointer: it is not compiled into programs that request no
/// accuracy.
pub(crate) type SelectSteps<'p> =
    for<'e> fn(&Request<'p>, f64, Collocation<'p>, Option<Terminal<'e>>) -> Result<StepSelection<'p>, InputError>;

/// How the steps of a run are determined.
#[derive(Clone)]
pub(crate) enum StepControl<'p> {
    Given(Steps),
    /// This number of steps of exactly this size.
    Exactly(usize, f64),
    /// The steps that trial runs select for this error.
    Accuracy(f64, SelectSteps<'p>, Collocation<'p>),
}

/// The request of a run, without its observers.
#[derive(Clone)]
pub(crate) struct Request<'p> {
    pub problem: SystemProblem<'p>,
    pub t_end: f64,
    pub span: f64,
    pub integrator: Option<SharedIntegrator<'p>>,
    pub needs: OutputRequest,
    /// The scales of the coordinates for errors, if they are given.
    pub scales: Option<Vector>,
    /// The collocation steppers of a Lagrangian with switching functions, for parts of steps.
    pub parts: Option<Collocation<'p>>,
    /// Whether nothing but the start and the end of the run is observed, so that a trial run may be the run.
    pub ends_only: bool,
}

/// The integrator and the steps that are selected for a run.
pub(crate) struct StepSelection<'p> {
    pub integrator: SharedIntegrator<'p>,
    pub count: usize,
    /// The step size; in transformed time, the step of tau.
    pub h: f64,
    /// The error that the trial runs found or predict; `None` for given steps.
    pub error: Option<f64>,
    /// The relative error of the stages at which the iterations of collocation steps end; 0 for round-off.
    pub tolerance: f64,
    /// The number of steps after which an observer is expected to end the run, if the steps fill a longer span.
    pub ended: Option<usize>,
    /// The stepper of a trial run with these steps, at the end of the span.
    pub end: Option<Box<dyn Stepper + 'p>>,
}

impl<'p> StepSelection<'p> {
    /// These steps over the whole span.
    pub fn new(integrator: SharedIntegrator<'p>, count: usize, h: f64, error: Option<f64>) -> Self {
        StepSelection { integrator, count, h, error, tolerance: 0.0, ended: None, end: None }
    }
}

/// The largest number of steps: up to it `t0 + k h` resolves times to a thousandth of a step.
pub(crate) const MAX_STEPS: f64 = (1u64 << 42) as f64;
