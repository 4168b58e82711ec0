//! Planning: the checks of a request, its steps and its route.

use crate::InputError;
use crate::integration::check_claims::check_claims_over;
use crate::integration::is_separable;
use crate::run::Plan;
use crate::run::accuracy::first_guess::first_guess;
use crate::run::accuracy::limits::DEFAULT_STAGES;
use crate::run::checks::rest::remains_at_rest;
use crate::run::observers::observer::Terminal;
use crate::run::observers::output_request::OutputRequest;
use crate::run::request::{MAX_STEPS, Request, SelectSteps, StepControl, StepSelection, Steps};
use crate::switching::Collocation;
use contact_geom::numbers::max_or_nan;

/// The number of times in the span at which the claims of structure are checked before a run with given steps.
const CHECKED_TIMES: usize = 16;

/// The same before trial runs, which check the equations of motion along the whole span.
const CHECKED_TIMES_BEFORE_TRIAL_RUNS: usize = 4;

impl<'p> Request<'p> {
    /// The plan of the request, after all checks of its input.
    pub(crate) fn plan(&self, length: StepControl<'p>, terminal: Option<Terminal<'_>>) -> Result<Plan<'p>, InputError> {
        let (problem, span) = (&self.problem, self.span);
        if !span.is_finite() {
            return Err(InputError::Span { span });
        }
        if span == 0.0 {
            return self.plan_of_the_start(length);
        }
        if let Some(integrator) = &self.integrator {
            integrator.check()?;
            let info = integrator.info();
            if info.in_transformed_time {
                self.dt_dtau()?;
            }
            // The step size for an accuracy is computed from a root of that order.
            if info.order == 0 {
                return Err(InputError::Hypothesis { hypothesis: "an integrator with an order of at least one" });
            }
        }
        let accuracy = matches!(length, StepControl::Accuracy(..));
        let times = if accuracy { CHECKED_TIMES_BEFORE_TRIAL_RUNS } else { CHECKED_TIMES };
        check_claims_over(&*problem.system, problem.t0, span, &problem.start, times)?;
        let requested = if let StepControl::Accuracy(wanted, ..) = &length { Some(*wanted) } else { None };
        let (selection, rests_after) = match length {
            StepControl::Accuracy(wanted, select_steps, collocation) => {
                self.within(wanted, select_steps, collocation, terminal)?
            }
            StepControl::Given(steps) => (self.given(steps)?, None),
            StepControl::Exactly(count, h) => (StepSelection { h, ..self.given(Steps::Count(count))? }, None),
        };
        check_count(selection.count as f64)?;
        let mut plan = Plan::new(self, selection)?;
        (plan.rests_after, plan.requested) = (rests_after, requested);
        // If an accuracy was requested, the trial runs have made these checks.
        if plan.error().is_none() {
            plan.check_first_steps()?;
        }
        Ok(plan)
    }

    /// The steps that trial runs select. After the motion has come to rest, errors relative to it are undefined: the trial
    /// runs end there, and the steps have their length, over the whole span. With the number of steps after which the
    /// motion is expected to be at rest.
    fn within(
        &self,
        wanted: f64,
        select_steps: SelectSteps<'p>,
        collocation: Collocation<'p>,
        terminal: Option<Terminal<'_>>,
    ) -> Result<(StepSelection<'p>, Option<usize>), InputError> {
        if wanted > 0.0 && remains_at_rest(&self.problem, self.needs, self.t_end) {
            let count = first_guess(self, DEFAULT_STAGES, wanted);
            let h = self.span / count as f64;
            let integrator = self.integrator.clone().unwrap_or_else(|| collocation.gauss(DEFAULT_STAGES));
            return Ok((StepSelection::new(integrator, count, h, Some(0.0)), Some(0)));
        }
        let Some(t_end) = self.time_of_rest(collocation.clone()) else {
            return Ok((select_steps(self, wanted, collocation, terminal)?, None));
        };
        let span = t_end - self.problem.t0;
        let moving = select_steps(&Request { t_end, span, ..self.clone() }, wanted, collocation, terminal)?;
        let (ended, rests_after) = (moving.ended, Some(moving.count));
        Ok((StepSelection { ended, ..moving.extended_by(self.span / span) }, rests_after))
    }

    /// The plan of a run that ends at its start time: no step is taken.
    fn plan_of_the_start(&self, length: StepControl<'p>) -> Result<Plan<'p>, InputError> {
        let (integrator, error) = match (length, &self.integrator) {
            (StepControl::Accuracy(wanted, ..), _) if !(wanted > 0.0 && wanted.is_finite()) => {
                return Err(InputError::Tolerance { wanted });
            }
            (StepControl::Accuracy(_, _, collocation), None) => (collocation.gauss(DEFAULT_STAGES), Some(0.0)),
            (StepControl::Accuracy(..), Some(integrator)) => (integrator.clone(), Some(0.0)),
            (StepControl::Given(steps), _) => (self.given(steps)?.integrator, None),
            (StepControl::Exactly(count, _), _) => (self.given(Steps::Count(count))?.integrator, None),
        };
        integrator.check()?;
        // The stepper needs a nonzero step size, although it takes no step.
        let h = f64::EPSILON * max_or_nan(self.problem.t0.abs(), 1.0);
        Plan::new(self, StepSelection::new(integrator, 0, h, error))
    }

    /// The given steps of the given integrator.
    fn given(&self, steps: Steps) -> Result<StepSelection<'p>, InputError> {
        let Some(integrator) = self.integrator.clone() else { return Err(InputError::NoIntegrator) };
        let rate = if integrator.info().in_transformed_time { Some(self.dt_dtau()?) } else { None };
        let span = self.span;
        let of = |count: usize, integrator| StepSelection::new(integrator, count, span / count as f64, None);
        match (steps, rate) {
            (Steps::Count(0), _) => Err(NO_STEP),
            (Steps::Count(_), Some(_)) => Err(InputError::Hypothesis { hypothesis: SIZED }),
            (Steps::Count(count), None) => Ok(of(count, integrator)),
            (Steps::Size(h), _) if !(h > 0.0 && h.is_finite()) => Err(InputError::Step { h }),
            // The factor keeps a step size that divides the span up to round-off.
            (Steps::Size(h), _) => {
                let count = (span.abs() / (h * rate.unwrap_or(1.0)) * (1.0 - 4.0 * f64::EPSILON)).ceil().max(1.0);
                check_count(count)?;
                let selection = of(count as usize, integrator);
                Ok(if rate.is_some() { StepSelection { h: h.copysign(span), ..selection } } else { selection })
            }
        }
    }

    /// The rate of the Lagrangian's time transformation at the start.
    fn dt_dtau(&self) -> Result<f64, InputError> {
        let rate = self.problem.system.dt_dtau(&self.problem.start.q);
        if rate > 0.0 && rate.is_finite() { Ok(rate) } else { Err(InputError::TimeTransformation { rate }) }
    }

    /// Whether the motion is under constraints: the free motion of the Lagrangian tells nothing about it.
    pub(crate) fn is_constrained(&self) -> bool {
        self.integrator.as_ref().is_some_and(|integrator| integrator.info().constrained)
    }

    /// Whether steps of Gauss collocation iterate the accelerations alone: L is separable, with a constant rate.
    pub(crate) fn iterates_accelerations(&self) -> bool {
        let structure = &self.problem.structure;
        is_separable(&*self.problem.system, structure) && structure.has_constant_rate()
    }

    /// Whether a trial run may be the run itself: it computes the state at the end alone, and perhaps the action.
    pub(crate) fn may_be_a_trial_run(&self) -> bool {
        let OutputRequest { conformal_factor, saved, derivatives, .. } = self.needs;
        // Claims that are not proved are checked along the run.
        let proved = self.problem.system.hints().proved;
        self.ends_only && proved && !conformal_factor && !saved && !derivatives
    }

    /// The same request without action and conformal factor.
    pub(crate) fn bare(&self) -> Self {
        Request { needs: OutputRequest::default(), ..self.clone() }
    }
}

/// The error of a run with 0 steps.
pub(crate) const NO_STEP: InputError = InputError::Count { what: "the number of steps", least: 1, found: 0 };

/// The hypothesis of integrators in transformed time on the steps.
const SIZED: &str = "steps of a given size in transformed time, or a requested accuracy, since the number of steps \
                     depends on the motion";

fn check_count(count: f64) -> Result<(), InputError> {
    if count <= MAX_STEPS {
        return Ok(());
    }
    let remedy = "take longer steps, or a shorter span";
    Err(InputError::TooMany { what: "the number of steps", found: count, most: MAX_STEPS, remedy })
}
