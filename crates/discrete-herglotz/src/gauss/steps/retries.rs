//! Fallbacks for a step in which the fixed-point iteration does not converge.

use crate::StepError;
use crate::gauss::steps::{GaussSteps, Solution};
use crate::gauss::system::CollocationSystem;

/// The methods that have been tried on a step.
#[derive(Default)]
pub(crate) struct Tried {
    /// Simplified Newton iteration with the Jacobian at the start of the step.
    pub simplified: bool,
    pub newton: bool,
    /// The first error of the step.
    pub refused: Option<StepError>,
}

impl GaussSteps {
    /// Selects the next method for a failed step: simplified Newton iteration with the Jacobian at the start of the
    /// step, then Newton's method. Returns the error `refused` if both have been tried.
    #[cold]
    pub(super) fn try_again(
        &mut self,
        system: &dyn CollocationSystem,
        tried: &mut Tried,
        refused: StepError,
    ) -> Result<(), StepError> {
        if !self.newton {
            return Err(refused);
        }
        tried.refused.get_or_insert(refused);
        // Together with the workspace of the simplified iteration, so that later steps do not allocate.
        self.route.reserve_newton(system);
        if !tried.simplified {
            tried.simplified = true;
            if self.solution != Solution::Simplified {
                self.pause_for(Solution::Simplified);
            }
            let t = self.time();
            if self.route.linearise_at_state(system, t) {
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

    /// Solves the stage equations of the next step by Newton's method.
    pub(super) fn solve_stages(&mut self, system: &dyn CollocationSystem) -> Result<(), StepError> {
        self.solved = false;
        let t = self.time();
        self.route.solve_stages(system, t)
    }

    /// Returns to the next less expensive method of solution when the pause is over.
    pub(super) fn resume(&mut self) {
        if self.solution != Solution::FixedPointIteration && self.pause == 0 {
            self.solution = match self.solution {
                Solution::Newton => Solution::Simplified,
                _ => Solution::FixedPointIteration,
            };
            self.pause = self.pauses;
            if self.solution == Solution::FixedPointIteration {
                self.route.suspend_newton();
            }
        }
    }
}
