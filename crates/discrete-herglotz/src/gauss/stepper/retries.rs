//! Fallbacks for a step in which the fixed-point iteration does not converge.

use crate::gauss::routes::StageRoute;
use crate::gauss::stepper::{GaussStepper, Route, Solution, with_route};
use crate::{StepError, Stepper};
use contact_geom::Lagrangian;

/// The methods that have been tried on a step.
#[derive(Default)]
pub(crate) struct Tried {
    /// Simplified Newton iteration with the Jacobian at the start of the step.
    pub simplified: bool,
    pub newton: bool,
    /// The first error of the step.
    pub refused: Option<StepError>,
}

impl<L: Lagrangian<N>, const N: usize> GaussStepper<'_, L, N> {
    /// Selects the next method for a failed step: simplified Newton iteration with the Jacobian at the start of the
    /// step, then Newton's method. Returns the error `refused` if both have been tried.
    #[cold]
    #[inline(never)]
    pub(crate) fn try_again(&mut self, tried: &mut Tried, refused: StepError) -> Result<(), StepError> {
        if !self.newton {
            return Err(refused);
        }
        tried.refused.get_or_insert(refused);
        // Together with the workspace of the simplified iteration, so that later steps do not allocate.
        with_route!(&mut *self.route, run => StageRoute::reserve_newton(run));
        if !tried.simplified {
            tried.simplified = true;
            if self.solution != Solution::Simplified {
                self.pause_for(Solution::Simplified);
            }
            if self.linearise() {
                return Ok(());
            }
        }
        if tried.newton {
            return Err(refused);
        }
        self.pause_for(Solution::Newton);
        Ok(())
    }

    /// Switches to another method of solution, for twice as many steps as the last time.
    fn pause_for(&mut self, solution: Solution) {
        self.solution = solution;
        self.pause = self.pauses;
        self.pauses = self.pauses.saturating_mul(2);
    }

    /// Solves the next steps by simplified Newton iteration with the Jacobian at the current state; `false` if the
    /// Jacobian is singular or not finite there.
    fn linearise(&mut self) -> bool {
        let t = self.time();
        with_route!(&mut *self.route, run => StageRoute::linearise_at_state(run, t))
    }

    /// Solves the stage equations of the next step by Newton's method.
    pub(crate) fn solve_stages(&mut self) -> Result<(), StepError> {
        self.solved = false;
        let t = self.time();
        with_route!(&mut *self.route, run => StageRoute::solve_stages(run, t))
    }

    /// Returns to the next less expensive method of solution when the pause is over.
    pub(crate) fn resume(&mut self) {
        if self.solution != Solution::FixedPointIteration && self.pause == 0 {
            self.solution = match self.solution {
                Solution::Newton => Solution::Simplified,
                _ => Solution::FixedPointIteration,
            };
            self.pause = self.pauses;
            if self.solution == Solution::FixedPointIteration {
                with_route!(&mut *self.route, run => StageRoute::suspend_newton(run));
            }
        }
    }
}
