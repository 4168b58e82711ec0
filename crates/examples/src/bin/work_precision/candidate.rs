//! What is measured: something that solves a problem, and has one number to trade time for accuracy.

use crate::problems::Problem;
use contact_geom::PhasePoint;
use discrete_herglotz::{DiscreteLagrangian, Flow, Halt, InputError, StepError, Stepper};
use std::time::Instant;
use thiserror::Error;

/// The number that trades time for accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// The time step of a method with a fixed one.
    Step,
    /// The relative tolerance of an adaptive one.
    Tolerance,
}

/// A method, set on one problem with or without the action.
pub trait Candidate {
    /// The name in tables and arguments, in lower case with underscores.
    fn name(&self) -> &'static str;

    /// The order.
    fn order(&self) -> u32;

    /// What [`run`](Self::run) is passed.
    fn control(&self) -> Control;

    /// Solves the problem once.
    ///
    /// # Errors
    /// [`RunError`] where there is no final state.
    fn run(&self, control: f64) -> Result<Run, RunError>;
}

/// A problem solved.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The final state: q, v, and z where it was asked for.
    pub state: Vec<f64>,
    /// The steps taken.
    pub steps: u64,
    /// The evaluations of right-hand sides, forces or gradients.
    pub evaluations: u64,
    /// The wall time of the integration: from a solver at the start to one at the end.
    pub seconds: f64,
}

/// Why a run has no final state.
#[derive(Debug, Error)]
pub enum RunError {
    /// The step is none, or nothing starts with it.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A step could not be taken.
    #[error("after {} steps: {}", .0.taken, .0.cause)]
    Halt(Halt),
    /// A peer gave up.
    #[error("{0}")]
    Peer(String),
}

/// Makes a plan for a time step.
type Plan<P> = dyn Fn(f64) -> Result<P, InputError>;

/// Sets a stepper with a plan on the start.
type Start<P, const N: usize> = dyn for<'a> Fn(&'a P) -> Result<Box<dyn Stepper<N> + 'a>, InputError>;

/// A method of the library that is driven as a [`Stepper`].
struct Stepped<P, const N: usize> {
    name: &'static str,
    order: u32,
    duration: f64,
    z: bool,
    plan: Box<Plan<P>>,
    start: Box<Start<P, N>>,
}

/// A candidate of two closures. The first makes, for a time step, what all runs with it share: a discrete Lagrangian, a table
/// of coefficients; or just the time step, where there is nothing of the kind. The second sets a stepper with it on the
/// problem's start. Neither is timed.
pub fn stepped<P: 'static, const N: usize>(
    (name, order): (&'static str, u32),
    (problem, z): (&Problem, bool),
    plan: impl Fn(f64) -> Result<P, InputError> + 'static,
    start: impl for<'a> Fn(&'a P) -> Result<Box<dyn Stepper<N> + 'a>, InputError> + 'static,
) -> Box<dyn Candidate> {
    let duration = problem.duration;
    Box::new(Stepped { name, order, duration, z, plan: Box::new(plan), start: Box::new(start) })
}

impl<P, const N: usize> Candidate for Stepped<P, N> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn order(&self) -> u32 {
        self.order
    }

    fn control(&self) -> Control {
        Control::Step
    }

    fn run(&self, h: f64) -> Result<Run, RunError> {
        let plan = (self.plan)(h)?;
        let mut stepper = (self.start)(&plan)?;
        let steps = (self.duration / h).round();
        let clock = Instant::now();
        stepper.advance(steps as usize).map_err(RunError::Halt)?;
        let seconds = clock.elapsed().as_secs_f64();
        let end = stepper.state();
        let mut state: Vec<f64> = end.q.iter().chain(end.p.iter()).copied().collect();
        if self.z {
            state.push(end.z);
        }
        Ok(Run { state, steps: steps as u64, evaluations: stepper.evaluations(), seconds })
    }
}

/// The flow of a discrete Lagrangian as a stepper.
pub struct FlowStepper<'a, D, const N: usize> {
    flow: Flow<'a, D, N>,
    sigma: f64,
    evaluations: u64,
}

impl<'a, D: DiscreteLagrangian<N>, const N: usize> FlowStepper<'a, D, N> {
    /// A stepper from a state at t = 0.
    ///
    /// # Errors
    /// Those of [`Flow::new`].
    pub fn new(ld: &'a D, state: PhasePoint<N>) -> Result<Self, InputError> {
        Ok(FlowStepper { flow: Flow::new(ld, 0.0, state)?, sigma: 1.0, evaluations: 0 })
    }
}

impl<D: DiscreteLagrangian<N>, const N: usize> Stepper<N> for FlowStepper<'_, D, N> {
    fn advance(&mut self, steps: usize) -> Result<(), Halt> {
        for taken in 0..steps {
            let step = self.flow.step().map_err(|cause: StepError| Halt { taken, cause })?;
            self.sigma = step.sigma;
            // A second jet an iteration, and the jet that makes the next momentum.
            self.evaluations += u64::from(step.iterations) + 1;
        }
        Ok(())
    }

    fn state(&self) -> PhasePoint<N> {
        *self.flow.state()
    }

    fn time(&self) -> f64 {
        self.flow.time()
    }

    fn sigma(&self) -> f64 {
        self.sigma
    }

    fn evaluations(&self) -> u64 {
        self.evaluations
    }
}
