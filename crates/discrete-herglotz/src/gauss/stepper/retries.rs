//! Fallbacks for a step in which the fixed-point iteration does not converge.

use super::{GaussStepper, Route, Solution};
use crate::gauss::stages::equations::{Given, Products, StageEquations, Workspace};
use crate::{StepError, Stepper, theory::legendre_inverse};
use contact_geom::{Derivatives, Lagrangian, VelocityPoint};

/// The methods that have been tried on a step.
#[derive(Default)]
pub(crate) struct Tried {
    /// Simplified Newton iteration with the Jacobian at the start of the step.
    pub simplified: bool,
    pub newton: bool,
    /// The first error of the step.
    pub refused: Option<StepError>,
}

/// The number of steps by a Newton method after which a less expensive iteration is tried again for the first time.
pub(crate) const PAUSE: usize = 8;

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
        match &mut *self.route {
            Route::Condensed(run) => run.reserve(),
            _ => self.make_newton(),
        }
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

    /// Allocates the workspace of Newton's method for the first step that needs it.
    fn make_newton(&mut self) {
        if self.by_newton.is_none() {
            let products = Products::new(self.s, self.h);
            let equations = StageEquations { lagrangian: self.lagrangian, products: &products, t: self.time() };
            let work = equations.workspace(&Given::Start(self.state()));
            self.by_newton = Some(Box::new((products, work)));
        }
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
        let (t, state) = (self.time(), self.state());
        match &mut *self.route {
            Route::Linear(..) => false,
            Route::Condensed(run) => {
                run.forget();
                run.linearise(t, state.q)
            }
            Route::General(run) => {
                let Ok(x) = legendre_inverse(self.lagrangian, t, &state, &run.last_velocity()) else { return false };
                run.guess(&x.v);
                run.linearise(&self.lagrangian.gradient(t, &x), &self.lagrangian.hessian(t, &x))
            }
        }
    }

    /// Solves the stage equations of the next step by Newton's method. The initial guess is a motion of constant
    /// velocity; the condensed route uses the forces of the step before, if they are known, or a motion without forces.
    pub(crate) fn solve_stages(&mut self) -> Result<(), StepError> {
        self.solved = false;
        let (t, from) = (self.time(), self.state());
        if let Route::General(_) = &*self.route {
            self.make_newton();
        }
        let run = match &mut *self.route {
            Route::Linear(..) => return Ok(()),
            Route::Condensed(run) => return run.solve(t),
            Route::General(run) => run,
        };
        let Some((products, work)) = self.by_newton.as_deref_mut() else { return Ok(()) };
        let equations = StageEquations { lagrangian: self.lagrangian, products, t };
        let VelocityPoint { v, .. } = legendre_inverse(self.lagrangian, t, &from, &run.last_velocity())?;
        equations.solve(&Given::Start(from), &v, &from.p, work)?;
        let Workspace { x, l, .. } = work;
        run.accept((0..self.s).map(|i| (x.v[i], l[i].re, x.rho[i])));
        Ok(())
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
                match &mut *self.route {
                    Route::Linear(..) => {}
                    Route::Condensed(run) => run.suspend_newton(),
                    Route::General(run) => run.suspend_newton(),
                }
            }
        }
    }
}
