//! Runs that an observer ends: the time of the end, for trial runs.

use crate::Status;
use crate::run::accuracy::first_guess::first_guess;
use crate::run::accuracy::limits::{EVENT_SEARCH, EVENT_SEARCH_BUDGET, EVENT_SEARCH_ERROR, MIN_EVENT_SEARCH_STEPS};
use crate::run::integrate::integrate;
use crate::run::request::{Request, StepSelection};
use crate::run::{Observer, Plan, StepView, Stop, Terminal};
use crate::switching::Collocation;
use std::ops::ControlFlow;

/// The cause of the end of a search that exceeds its budget.
const SPENT: &str = "the budget of the search";

/// Ends a search whose evaluations exceed its budget.
struct Budget;

impl Observer for Budget {
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        match at.stepper.evaluations() {
            spent if spent > EVENT_SEARCH_BUDGET => ControlFlow::Break(Stop::here(SPENT)),
            _ => ControlFlow::Continue(()),
        }
    }
}

impl<'p> Request<'p> {
    /// The approximate time at which an observer ends the run; `None` if none ends it within the budget.
    pub(crate) fn time_of_end(&self, collocation: &Collocation<'p>, terminal: Terminal<'_>) -> Option<f64> {
        if self.is_constrained() {
            return None;
        }
        let request = Request { integrator: None, needs: terminal.needs(), ..self.clone() };
        let count = first_guess(self, EVENT_SEARCH.stages, EVENT_SEARCH_ERROR).max(MIN_EVENT_SEARCH_STEPS);
        let h = self.span / count as f64;
        let integrator = collocation.divided_gauss(EVENT_SEARCH);
        let selection = StepSelection::new(integrator, count, h, Some(EVENT_SEARCH_ERROR));
        let plan = Plan::new(&request, selection).ok()?;
        let outcome = integrate(&plan, &mut vec![terminal, Box::new(Budget)], None).ok()?;
        match outcome.status {
            Status::Stopped { by, .. } if by != SPENT => Some(outcome.t),
            _ => None,
        }
    }
}

impl<'p> StepSelection<'p> {
    /// The same steps over a multiple of the span; an observer is expected to end the run after the original number of
    /// steps.
    pub(crate) fn extended_by(self, factor: f64) -> Self {
        let count = (self.count as f64 * factor * (1.0 - 4.0 * f64::EPSILON)).ceil();
        // In transformed time the step size is independent of the number of steps.
        let h = if self.integrator.info().in_transformed_time {
            self.h
        } else {
            self.h * (self.count as f64 * factor / count)
        };
        StepSelection { h, count: count as usize, ended: Some(self.count), end: None, ..self }
    }
}
