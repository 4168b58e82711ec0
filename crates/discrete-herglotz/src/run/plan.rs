//! The plan of a run: its steps, its route, and what they compute and skip.

use crate::integration::check_claims::violated_claim;
use crate::run::checks::next_full_check;
use crate::run::discretization::Discretization;
use crate::run::findings::Findings;
use crate::run::observers::step_view::StepView;
use crate::run::request::{Request, StepSelection};
use crate::{InputError, MethodInfo, PlanEntry, State, Stepper, UnresolvedStep};
use contact_geom::{Defect, Structure};
use std::cell::Cell;
use std::fmt::{Display, Formatter};

/// The number of initial steps along which the claims of structure are checked before a run, so that a false claim that
/// shows only in motion is an error of the input and not of the run: seven checks, at powers of two.
const MAX_STEPS_CHECKED_FIRST: usize = 64;

/// The reason why the steps of a run with a force keep no contact form.
const FORCED: &str = "not contact: forced; the defect is the virtual work of the force";

/// The reason why the steps of a run under constraints on velocities keep no contact form.
const NONHOLONOMIC: &str = "not contact, as the motion: sigma_d multiplies the energy of an autonomous L and the momenta \
                            of horizontal symmetries";

/// A run after the checks of its input, with its steps and its route; created by [`Run::plan`](crate::Run::plan). Its
/// `Display` output lists what will be computed and what is skipped.
pub struct Plan<'p> {
    pub(crate) steps: Discretization<'p>,
    /// The number of steps after which an observer is expected to end the run.
    pub(crate) ends_after: Option<usize>,
    work_summary: Vec<PlanEntry>,
    /// Whether `sigma_d` is the same in all steps.
    pub(crate) constant_rate: bool,
    /// The requested error.
    pub(crate) requested: Option<f64>,
    /// Whether an error estimate was requested.
    pub(crate) estimated: bool,
    /// The number of steps after which the motion is expected to be at rest; no step is taken after that.
    pub(crate) rests_after: Option<usize>,
    /// A stepper at the start, for the first run of the plan.
    start: Cell<Option<Box<dyn Stepper + 'p>>>,
    /// The stepper of the trial run with these steps, at its end: the first run of the plan is that run.
    end: Cell<Option<Box<dyn Stepper + 'p>>>,
}

impl<'p> Plan<'p> {
    /// The plan of a request with its selected steps.
    pub(crate) fn new(request: &Request<'p>, selection: StepSelection<'p>) -> Result<Self, InputError> {
        let steps = Discretization::new(request, &selection)?;
        let end = selection.end.filter(|_| steps.problem_for_steps().structure == steps.problem.structure);
        let stepper = steps.stepper(steps.error.is_none())?;
        Ok(Plan {
            ends_after: selection.ended,
            work_summary: stepper.work_summary(),
            constant_rate: stepper.run_support().is_some_and(|run| run.has_constant_rate()),
            requested: None,
            estimated: false,
            rests_after: None,
            start: Cell::new(Some(stepper)),
            end: Cell::new(end),
            steps,
        })
    }

    /// The time step, negative if the run goes backward in time; for an integrator in transformed time, the step of
    /// tau.
    pub fn step_size(&self) -> f64 {
        self.steps.h
    }

    /// The number of steps. For steps of a given size in transformed time it is an estimate from `dt/dtau` at the
    /// start. An observer may end the run earlier, and no step is taken after the motion has come to rest.
    pub fn count(&self) -> usize {
        self.steps.count
    }

    /// Information about the integrator, whether given or selected.
    pub fn integrator(&self) -> &MethodInfo {
        &self.steps.info
    }

    /// The error of (q, p) and v that the trial runs found or predict; `None` if no accuracy was requested. It exceeds the
    /// requested error where the last digit of the start decides a motion with resets; outcomes are flagged then.
    pub fn error(&self) -> Option<f64> {
        self.steps.error
    }

    /// The flag of a run whose requested error is exceeded because the last digit of its start decides it.
    pub(crate) fn unreached_accuracy(&self) -> Option<UnresolvedStep> {
        let (error, requested) = self.steps.error.zip(self.requested)?;
        (error > requested).then_some(UnresolvedStep { step: 0, defect: error / requested })
    }

    /// A stepper at the start, for programs that take the steps themselves. In transformed time use
    /// [`RunSupport::advance_until`](crate::RunSupport::advance_until), which ends at the end of the span. The stepper of
    /// a splitting does not monitor whether its steps resolve the motion, which would take up to a third of the time.
    ///
    /// # Errors
    /// Those of the creation of the stepper.
    pub fn stepper(&self) -> Result<Box<dyn Stepper + 'p>, InputError> {
        self.steps.stepper(false)
    }

    /// The stepper for a run of the plan; the first run takes the one that was created with the plan.
    pub(crate) fn take_stepper(&self) -> Result<Box<dyn Stepper + 'p>, InputError> {
        self.start.take().map_or_else(|| self.steps.stepper(self.steps.error.is_none()), Ok)
    }

    /// The stepper of the trial run that the run is.
    pub(crate) fn take_end(&self) -> Option<Box<dyn Stepper + 'p>> {
        self.end.take()
    }

    /// The view of the observers after `k` steps.
    pub(crate) fn view<'r>(
        &'r self,
        stepper: &'r dyn Stepper,
        before: Option<(f64, State)>,
        findings: Findings,
        (k, last): (usize, bool),
    ) -> StepView<'r> {
        let log_factor = self.steps.needs.conformal_factor.then_some(findings.log_factor);
        let (t, state, sigma, motion) = (stepper.time(), stepper.state(), stepper.sigma(), &self.steps);
        StepView {
            k,
            t,
            state,
            sigma,
            log_factor,
            last,
            findings,
            before,
            motion,
            stepper,
            in_failed_step: false,
            at_rest: None,
        }
    }

    /// Checks the claims of structure along the first steps.
    ///
    /// # Errors
    /// [`InputError::FalseClaim`] with the first claim that is violated.
    pub(crate) fn check_first_steps(&self) -> Result<(), InputError> {
        if self.steps.problem.system.hints().proved {
            return Ok(());
        }
        let Discretization { problem, count, t_end, .. } = &self.steps;
        let mut stepper = self.stepper()?;
        let mut taken = 0;
        while taken < MAX_STEPS_CHECKED_FIRST.min(*count) {
            let steps = next_full_check(taken).min(*count) - taken;
            match stepper.advance_until(steps, *t_end) {
                Ok(done) if done > 0 => taken += done,
                _ => break,
            }
            let near = stepper.last_velocity();
            let guess = near.as_ref().unwrap_or(&problem.start.v);
            if let Some(Defect { claim, size }) =
                violated_claim(&*problem.system, stepper.time(), &stepper.state(), guess)
            {
                return Err(InputError::FalseClaim { claim, size });
            }
        }
        Ok(())
    }

    /// The quantities that the run computes and skips, within its steps and otherwise.
    pub fn entries(&self) -> Vec<PlanEntry> {
        let (needs, structure) = (self.steps.needs, self.steps.problem.structure);
        let mut entries = self.work_summary.clone();
        if needs.action {
            entries.retain(|entry| entry.what != "action z");
            entries.push(PlanEntry::computed("action z", "requested"));
        }
        let what = "conformal factor";
        entries.push(match (needs.conformal_factor, self.constant_rate) {
            (false, true) => PlanEntry::skipped(what, "not requested; sigma_d is the same in every step"),
            (true, true) => PlanEntry::computed(
                what,
                "requested; sigma_d is the same in every step, and its power is computed at the end",
            ),
            (true, false) => {
                PlanEntry::computed(what, "requested; sigma_d varies, and its product is computed along the run")
            }
            (false, false) => PlanEntry::skipped(what, "not requested; each step checks that its sigma_d is positive"),
        });
        let what = "checks of the structure";
        entries.push(if self.steps.problem.system.hints().proved {
            PlanEntry::skipped(what, "the structure is proved from the formula of L")
        } else if structure == Structure::default() {
            PlanEntry::skipped(what, "L claims no property")
        } else {
            PlanEntry::computed(what, "the properties that L claims are checked at the start and along the run")
        });
        if self.steps.problem.system.has_force() {
            entries.push(PlanEntry::skipped("contact form", FORCED));
        }
        if !self.steps.info.contact {
            entries.push(PlanEntry::skipped("contact form", NONHOLONOMIC));
        }
        let (what, autonomous) = ("time at the stages", structure.autonomous);
        let why = match (autonomous, self.steps.problem.system.has_force()) {
            (true, _) => "L does not depend on t",
            (false, false) => "L depends on t",
            (false, true) => "L or the force may depend on t",
        };
        entries.push(PlanEntry { what, computed: !autonomous, why: why.into() });
        entries
    }
}

impl Display for Plan<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let Discretization { problem, count, h, info, t_end, .. } = &self.steps;
        let (t0, entries) = (problem.t0, self.entries());
        let of = if info.in_transformed_time { " in transformed time" } else { "" };
        writeln!(f, "{count} steps of {h}{of} by {}, t = {t0} .. {t_end}", info.name)?;
        for (title, computed) in [("computed", true), ("skipped", false)] {
            writeln!(f, "{title}:")?;
            for entry in entries.iter().filter(|entry| entry.computed == computed) {
                writeln!(f, "  {}: {}", entry.what, entry.why)?;
            }
        }
        Ok(())
    }
}
