//! Runs that an observer ends: where that is, for trial runs, and how it is reached in a step that cannot be taken as a whole.

use crate::run::accuracy::first_guess::first_guess;
use crate::run::integrate::integrate;
use crate::run::request::{Request, StepSelection};
use crate::run::{Plan, StepView, Stop, Terminal};
use crate::{DividedGauss, Status};
use contact_geom::Lagrangian;
use std::ops::ControlFlow;
use std::sync::Arc;

/// The search for the end: by steps so long that they resolve the motion, with an error of about the square of this.
const SEARCH: DividedGauss = DividedGauss { stages: 8, most_misfit: 1e-5 };

/// The steps of the search, at the least, and the error of the motion linearised at its start that says how many they are.
const FEWEST: usize = 64;
const ERROR: f64 = 1e-6;

/// What the search may cost, in evaluations of L: about a second.
const BUDGET: u64 = 1 << 24;

/// Who ends a search that costs too much.
const SPENT: &str = "the budget of the search";

impl<'p, L: Lagrangian<N>, const N: usize> Request<'p, L, N> {
    /// About the time at which an observer ends the run; `None` where it ends elsewhere.
    pub(crate) fn time_of_end(&self, terminal: Terminal<'_, N>) -> Option<f64> {
        let request = Request { integrator: None, needs: terminal.needs(), ..*self };
        let count = first_guess(self, SEARCH.stages, ERROR).max(FEWEST);
        let h = self.span / count as f64;
        let choice = StepSelection { integrator: Arc::new(SEARCH), count, h, error: Some(ERROR), ended: None };
        let plan = Plan::new(&request, &choice).ok()?;
        let budget = |at: &StepView<'_, N>| match at.stepper.evaluations() {
            spent if spent > BUDGET => ControlFlow::Break(Stop::here(SPENT)),
            _ => ControlFlow::Continue(()),
        };
        let outcome = integrate(&plan, &mut vec![terminal, Box::new(budget)], None).ok()?;
        match outcome.status {
            Status::Stopped { by, .. } if by != SPENT => Some(outcome.t),
            _ => None,
        }
    }
}

impl<'p, L: Lagrangian<N>, const N: usize> StepSelection<'p, L, N> {
    /// The same steps over so many times the span, as an observer ends the run where these end.
    pub(crate) fn going_on(self, times: f64) -> Self {
        let count = (self.count as f64 * times * (1.0 - 4.0 * f64::EPSILON)).ceil();
        // Steps in transformed time are counted on the way.
        let h = if self.integrator.info().in_transformed_time {
            self.h
        } else {
            self.h * (self.count as f64 * times / count)
        };
        StepSelection { h, count: count as usize, ended: Some(self.count), ..self }
    }
}
