//! Candidates: solvers of a problem with one parameter that trades run time for accuracy.

use crate::problems::Problem;
use crate::row::Action;
use contact_geom::{Lagrangian, PhasePoint};
use discrete_herglotz::theory::legendre_inverse;
use discrete_herglotz::{AnyIntegrator, InputError, StepError, StepFailure, Steps, Until};
use std::time::Instant;
use thiserror::Error;

/// The parameter that trades run time for accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// The time step of a method with a fixed one.
    Step,
    /// The relative tolerance of an adaptive one.
    Tolerance,
}

/// A method for one problem, with or without the action.
pub trait Candidate {
    /// The name in tables and arguments, in lower case with underscores.
    fn name(&self) -> &str;

    /// The order.
    fn order(&self) -> u32;

    /// The meaning of the argument of [`run`](Self::run).
    fn control(&self) -> Control;

    /// Solves the problem once.
    ///
    /// # Errors
    /// [`RunError`] where there is no final state.
    fn run(&self, control: f64) -> Result<Run, RunError>;
}

/// The solution of a problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The final state: q, v, and z where it was requested.
    pub state: Vec<f64>,
    /// The steps taken.
    pub steps: u64,
    /// The evaluations of right-hand sides, forces or gradients.
    pub evaluations: u64,
    /// The wall time of the integration, without the set-up of the solver.
    pub seconds: f64,
}

/// Why a run has no final state.
#[derive(Debug, Error)]
pub enum RunError {
    /// The step size is invalid, or no run can start with it.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A step could not be taken.
    #[error("after {} steps: {}", .0.taken, .0.cause)]
    StepFailure(StepFailure),
    /// The final velocity was not found.
    #[error(transparent)]
    Velocity(#[from] StepError),
    /// A peer failed.
    #[error("{0}")]
    Peer(String),
}

/// An integrator of the library for a problem's Lagrangian.
struct OfLibrary<L, const N: usize> {
    lagrangian: L,
    integrator: AnyIntegrator,
    name: String,
    problem: Problem,
    z: Action,
}

/// A candidate that runs an integrator of the library by a plan. The plan is made before the time measurement starts,
/// like the peers' solvers.
pub fn of_library<L: Lagrangian<N> + 'static, const N: usize>(
    lagrangian: L,
    integrator: AnyIntegrator,
    problem: &Problem,
    z: Action,
) -> Box<dyn Candidate> {
    Box::new(OfLibrary { lagrangian, integrator, name: integrator.to_string(), problem: *problem, z })
}

impl<L: Lagrangian<N>, const N: usize> Candidate for OfLibrary<L, N> {
    fn name(&self) -> &str {
        &self.name
    }

    fn order(&self) -> u32 {
        self.integrator.order()
    }

    fn control(&self) -> Control {
        Control::Step
    }

    fn run(&self, h: f64) -> Result<Run, RunError> {
        let motion = discrete_herglotz::Problem::new(&self.lagrangian, 0.0, self.problem.point())?;
        let run = motion.by(self.integrator).steps(Steps::Size(h));
        let run = if self.z == Action::On { run } else { run.without_action() };
        let plan = run.plan(Until::Time(self.problem.duration))?;
        let mut stepper = plan.stepper()?;
        let clock = Instant::now();
        stepper.advance(plan.count()).map_err(RunError::StepFailure)?;
        let seconds = clock.elapsed().as_secs_f64();
        let end: PhasePoint<N> = stepper.state().fixed();
        let v = match self.problem.has_unit_mass() {
            true => end.p,
            false => legendre_inverse(&self.lagrangian, self.problem.duration, &end, &end.p)?.v,
        };
        let mut state: Vec<f64> = end.q.iter().chain(v.iter()).copied().collect();
        if self.z == Action::On {
            state.push(end.z);
        }
        Ok(Run { state, steps: plan.count() as u64, evaluations: stepper.evaluations(), seconds })
    }
}

/// A call for a problem: with given steps of an integrator, or for a requested error.
struct Call<L, const N: usize> {
    lagrangian: L,
    by: Option<AnyIntegrator>,
    name: String,
    problem: Problem,
    z: Action,
}

impl<L: Lagrangian<N>, const N: usize> Candidate for Call<L, N> {
    fn name(&self) -> &str {
        &self.name
    }

    fn order(&self) -> u32 {
        self.by.map_or(0, |by| by.order())
    }

    fn control(&self) -> Control {
        if self.by.is_some() { Control::Step } else { Control::Tolerance }
    }

    fn run(&self, control: f64) -> Result<Run, RunError> {
        let clock = Instant::now();
        let motion = discrete_herglotz::Problem::new(&self.lagrangian, 0.0, self.problem.point())?;
        let run = match self.by {
            Some(by) => motion.by(by).steps(Steps::Size(control)),
            None => motion.accuracy(control),
        };
        let run = if self.z == Action::On { run } else { run.without_action() };
        let outcome = run.run(Until::Time(self.problem.duration))?;
        let seconds = clock.elapsed().as_secs_f64();
        let n = outcome.q.len();
        let v = outcome.v.map_or_else(|| vec![f64::NAN; n], |v| v.iter().copied().collect());
        let state = outcome.q.iter().copied().chain(v).chain(outcome.z).collect();
        Ok(Run { state, steps: outcome.steps as u64, evaluations: outcome.evaluations, seconds })
    }
}

/// A candidate that times whole calls, from the Lagrangian to the outcome: with given steps of an integrator, or for a
/// requested error.
pub fn call<L: Lagrangian<N> + 'static, const N: usize>(
    lagrangian: L,
    by: Option<AnyIntegrator>,
    problem: &Problem,
    z: Action,
) -> Box<dyn Candidate> {
    let name = by.map_or_else(|| "accuracy".to_owned(), |by| by.to_string());
    Box::new(Call { lagrangian, by, name, problem: *problem, z })
}
