//! The routes of a contact Gauss step: the reduced forms of the stage equations that the structure of L allows.

pub(crate) mod general;
pub(crate) mod hamiltonian;
pub(crate) mod linear;
pub(crate) mod separable;
pub(crate) mod transformed;

use crate::StepError;
use crate::gauss::curve::Curve;
use crate::gauss::dense::{Solved, SolvedStep, StepStart};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::system::CollocationSystem;
use crate::gauss::work_summary::GaussRoute;
use crate::numbers::compensated::CompensatedSum;
#[cfg(test)]
use crate::numbers::instructions::Instructions;
use crate::numbers::state_words::Saved;

/// The state of a motion in the variables of a route: y are velocities in the condensed routes, momenta in the others.
pub(crate) struct RouteState<'r> {
    pub q: &'r [CompensatedSum],
    pub y: &'r [CompensatedSum],
    pub z: CompensatedSum,
}

/// The same, to change the compensation terms of its sums.
pub(crate) struct RouteStateMut<'r> {
    pub q: &'r mut [CompensatedSum],
    pub y: &'r mut [CompensatedSum],
    pub z: &'r mut CompensatedSum,
}

/// Writes the velocity of a stage, and returns its value of L and its integrating factor.
pub(crate) type GuessedStage<'r> = &'r mut dyn FnMut(usize, &mut [f64]) -> (f64, f64);

/// A route: the state of the motion, with the workspace and the solution of the stage equations of its steps. The system is
/// the same in all calls.
///
/// [`GaussStepper`](crate::gauss::GaussStepper) selects the method of solution: fixed-point iteration, simplified
/// Newton iteration after [`linearise_at_state`](Self::linearise_at_state), Newton's method by
/// [`solve_stages`](Self::solve_stages).
pub(crate) trait StageRoute: Saved {
    /// The name of the route.
    fn route(&self) -> GaussRoute;

    fn state(&self) -> RouteState<'_>;

    fn state_mut(&mut self) -> RouteStateMut<'_>;

    /// Ends the iterations of the following steps when the remaining error of the stages, relative to their terms, is at most
    /// this. The default is no change: round-off.
    fn set_tolerance(&mut self, _tolerance: f64) {}

    /// Takes one step from the time `t`; on failure the state is unchanged.
    fn step(&mut self, system: &dyn CollocationSystem, t: f64) -> IterationOutcome;

    /// Takes a number of steps at once, if the route can: the number of steps taken, which is smaller if the state is no
    /// longer finite; the start of the last one is written.
    fn take_steps(&mut self, _steps: usize, _last: &mut StepStart) -> Option<usize> {
        None
    }

    /// The defect of the last step; above one if it does not resolve the motion.
    fn defect(&self) -> f64;

    /// The number of sets of sample points for a defect sample that is requested after a run: one if each step has a
    /// [`defect`](Self::defect).
    fn sample_sets(&self) -> usize {
        1
    }

    /// `sigma_d` of the last step.
    fn sigma(&self) -> f64;

    fn evaluations(&self) -> u64;

    /// Forgets all steps but the state, so that the next one is as the first of a new route, from a velocity; `false` if the
    /// route may have changed what it was made with. The default is `false`.
    fn restart(&mut self, _v: &[f64]) -> bool {
        false
    }

    /// The velocity at the end of the last step, if the route has it.
    fn last_velocity(&self) -> Option<&[f64]> {
        None
    }

    /// Sets the initial guess of the next step, if the route uses one that it does not extrapolate.
    fn predict_stages(&mut self, _stage: GuessedStage<'_>) {}

    /// Allocates the workspace of the Newton methods, so that later steps do not allocate.
    fn reserve_newton(&mut self, system: &dyn CollocationSystem);

    /// Switches to simplified Newton iteration with the Jacobian at the current state; `false` if it is singular or not
    /// finite there.
    fn linearise_at_state(&mut self, system: &dyn CollocationSystem, t: f64) -> bool;

    /// Returns to fixed-point iteration.
    fn suspend_newton(&mut self);

    /// Solves the stage equations of the next step, from the time `t`, by Newton's method; the next call of
    /// [`step`](Self::step) uses them.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Singular`], [`StepError::NonFinite`], and those of the Legendre
    /// transform.
    fn solve_stages(&mut self, system: &dyn CollocationSystem, t: f64) -> Result<(), StepError>;

    /// Writes the stages of the last step, with the values of L if they are requested or known; returns whether they are.
    fn solved(&self, system: &dyn CollocationSystem, step: &SolvedStep<'_>, wants_l: bool, to: Solved<'_>) -> bool;

    /// Collects the stages of the last step in a curve, for defect samples.
    fn collect(&self, system: &dyn CollocationSystem, step: &SolvedStep<'_>, curve: &mut Curve);

    /// Takes the following steps with an instruction set.
    #[cfg(test)]
    fn set_instructions(&mut self, arch: Instructions);

    /// Does not update the actions with the positions within an iteration.
    #[cfg(test)]
    fn let_actions_lag(&mut self) {}
}
