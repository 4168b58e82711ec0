//! Runs that an observer ends: where that is, for trial runs, and how it is reached in a step that cannot be taken as a whole.

use crate::run::accuracy::{StepSelection, first_guess};
use crate::run::checks::energy::EnergySums;
use crate::run::{Observer, Plan, Request, RunInfo, StepView, Stop, Terminal};
use crate::{DividedGauss, Status, Stepper, UnresolvedStep};
use contact_geom::{Lagrangian, PhasePoint};
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

/// The halvings of a step that cannot be taken: the part that can be is then known to the rounding of the step.
const HALVINGS: usize = 48;

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
        let outcome = plan.observed_by(&mut vec![terminal, Box::new(budget)], None).ok()?;
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

/// The run as observers see it before a step.
#[derive(Clone, Copy)]
pub(crate) struct Before<'s, const N: usize> {
    pub stepper: &'s dyn Stepper<N>,
    pub course: RunInfo,
    /// The logarithm of the conformal factor, what was noted, and the energies.
    pub noted: (f64, Option<UnresolvedStep>, EnergySums),
    pub taken: usize,
}

impl<L: Lagrangian<N>, const N: usize> Plan<'_, L, N> {
    /// The end of the run by an observer within a step that cannot be taken as a whole, with the logarithm of the conformal factor there:
    /// all observers see the part of the step in which it lies. `None` where none ends it.
    pub(crate) fn end_within_a_step(
        &self,
        observers: &mut Vec<Box<dyn Observer<N> + '_>>,
        before: Before<'_, N>,
    ) -> Option<(Stop<N>, Option<f64>)> {
        let Before { stepper, course, noted, taken } = before;
        let from = (stepper.time(), stepper.state());
        let whole = if self.info.in_transformed_time { self.t_end - from.0 } else { self.h };
        let (mut possible, mut impossible) = (0.0, 1.0);
        let mut ending = None;
        let mut terminal = observers.terminal()?;
        for _ in 0..HALVINGS {
            let fraction = 0.5 * (possible + impossible);
            let Ok(part) = self.step_to(&from, from.0 + fraction * whole, stepper.last_velocity(), None) else {
                impossible = fraction;
                continue;
            };
            // From the start of the step, as that is what it is shown.
            terminal.prepare(&course).ok()?;
            if terminal.start(&self.moment(stepper, None, noted, (taken, false))).is_break() {
                return None;
            }
            if let ControlFlow::Break(stop) = terminal.step(&self.after_part(&*part, from, before)) {
                ending = stop.at.is_some().then_some(part);
                break;
            }
            possible = fraction;
        }
        drop(terminal);
        let part = ending?;
        let end = self.after_part(&*part, from, before);
        let stop = observers.step(&end).break_value()?;
        let (t, _) = stop.at?;
        Some((stop, end.inside(t).ok().and_then(|there| there.log_factor)))
    }

    /// What observers see after a part of a step.
    fn after_part<'r>(
        &'r self,
        part: &'r dyn Stepper<N>,
        from: (f64, PhasePoint<N>),
        Before { noted: (log_factor, unresolved, energy), taken, .. }: Before<'_, N>,
    ) -> StepView<'r, N> {
        let noted = (log_factor + part.sigma().ln(), unresolved, energy);
        StepView { in_failed_step: true, ..self.moment(part, Some(from), noted, (taken + 1, false)) }
    }
}
