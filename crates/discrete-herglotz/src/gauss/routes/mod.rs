//! The routes of a contact Gauss step: the reduced forms of the stage equations that the structure of L allows.

pub(crate) mod hamiltonian;
pub(crate) mod linear;
pub(crate) mod separable;

use crate::StepError;
use crate::gauss::dense::{Solved, SolvedStep, StepStart};
use crate::gauss::resolution::defect_sample::Curve;
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::work_summary::GaussRoute;
use crate::numbers::compensated::CompensatedSum;
use crate::numbers::state_words::Saved;
use contact_geom::nalgebra::SVector;
use pulp::Simd;

/// The state of a motion in the variables of a route: y are velocities in the condensed routes, momenta in the general
/// one.
pub(crate) struct RouteState<'r, const N: usize> {
    pub q: &'r [CompensatedSum; N],
    pub y: &'r [CompensatedSum; N],
    pub z: CompensatedSum,
}

/// A route: the state of the motion, with the workspace and the solution of the stage equations of its steps.
///
/// [`GaussStepper`](crate::gauss::GaussStepper) selects the method of solution: fixed-point iteration, simplified
/// Newton iteration after [`linearise`](Self::linearise), Newton's method by [`solve_stages`](Self::solve_stages).
pub(crate) trait StageRoute<const N: usize>: Saved {
    /// The name of the route.
    fn route(&self) -> GaussRoute;

    fn state(&self) -> RouteState<'_, N>;

    /// Replaces the compensation terms of the state's sums.
    fn set_compensation(&mut self, terms: &StepStart<N>);

    /// Takes one step from the time `t`; on failure the state is unchanged.
    fn step<S: Simd>(&mut self, t: f64) -> IterationOutcome;

    /// Takes a number of steps at once, if the route can: the number of steps taken, which is smaller if the state is no
    /// longer finite, and the start of the last one.
    #[inline(always)]
    fn take_steps(&mut self, _steps: usize) -> Option<(usize, StepStart<N>)> {
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

    /// The velocity at the end of the last step, if the route has it.
    fn last_velocity(&self) -> Option<SVector<f64, N>> {
        None
    }

    /// Sets the initial guess of the next step, if the route uses one that it does not extrapolate: velocities, values
    /// of L and integrating factors of the stages.
    fn predict_stages(&mut self, _stages: impl Iterator<Item = (SVector<f64, N>, f64, f64)>) {}

    /// Allocates the workspace of the Newton methods, so that later steps do not allocate.
    fn reserve_newton(&mut self);

    /// Switches to simplified Newton iteration with the Jacobian at the current state; `false` if it is singular or not
    /// finite there.
    fn linearise_at_state(&mut self, t: f64) -> bool;

    /// Returns to fixed-point iteration.
    fn suspend_newton(&mut self);

    /// Solves the stage equations of the next step, from the time `t`, by Newton's method; the next call of
    /// [`step`](Self::step) uses them.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Singular`], [`StepError::NonFinite`], and those of the Legendre
    /// transform.
    fn solve_stages(&mut self, t: f64) -> Result<(), StepError>;

    /// The stages of the last step, for dense output.
    fn solved(&self, step: &SolvedStep<'_, N>) -> Solved<N>;

    /// The stages of the last step without the values of L, if these are computed separately.
    fn solved_without_action(&self, _step: &SolvedStep<'_, N>) -> Option<Solved<N>> {
        None
    }

    /// Collects the stages of the last step in a curve, for defect samples.
    fn collect<S: Simd>(&self, step: &SolvedStep<'_, N>, curve: &mut Curve<N>);
}

/// Sets the compensation terms of the sums of a route's state.
pub(crate) fn set_compensation<const N: usize>(
    (q, y, z): (&mut [CompensatedSum; N], &mut [CompensatedSum; N], &mut CompensatedSum),
    terms: &StepStart<N>,
) {
    for d in 0..N {
        (q[d].rest, y[d].rest) = (terms.q[d], terms.y[d]);
    }
    z.rest = terms.z;
}
