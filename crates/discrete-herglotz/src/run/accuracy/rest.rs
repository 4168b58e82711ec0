//! Motions that have come to rest.

use crate::StepperOptions;
use crate::run::accuracy::first_guess::first_guess;
use crate::run::accuracy::limits::{
    DEFAULT_STAGES, MAX_REST_SEARCH_STEPS, MIN_DECAY_TO_REST, REST_SEARCH_ERROR, STEPS_BETWEEN_REST_CHECKS,
};
use crate::run::checks::rest::{is_at_rest, rests_at_the_origin, starts_at_rest};
use crate::run::request::Request;
use crate::switching::Collocation;

impl<'p> Request<'p> {
    /// The time at which the motion comes to rest, if it lies within the span; found with steps of eight stages, if the
    /// span is long enough for the decay.
    #[inline(never)]
    pub(crate) fn time_of_rest(&self, collocation: Collocation<'p>) -> Option<f64> {
        if self.is_constrained() {
            return None;
        }
        let problem = &self.problem;
        let rate = problem.system.gradient(problem.t0, &problem.start).z;
        // Written so that a NaN counts as no decrease.
        let decays = rate * self.span < -MIN_DECAY_TO_REST;
        if !decays || starts_at_rest(problem) || !rests_at_the_origin(problem, problem.start.z, self.span) {
            return None;
        }
        // The steps for this decay are those of any longer span.
        let span = -MIN_DECAY_TO_REST / rate;
        let decay = Request { t_end: problem.t0 + span, span, ..self.clone() };
        let h = span / first_guess(&decay, DEFAULT_STAGES, REST_SEARCH_ERROR) as f64;
        let options = StepperOptions { action: self.needs.action, ..StepperOptions::default() };
        let mut stepper = collocation.stepper(problem, DEFAULT_STAGES, h, options).ok()?;
        for _ in 0..MAX_REST_SEARCH_STEPS / STEPS_BETWEEN_REST_CHECKS {
            stepper.advance(STEPS_BETWEEN_REST_CHECKS).ok()?;
            let t = stepper.time();
            if (t - problem.t0).abs() >= self.span.abs() {
                return None;
            }
            if is_at_rest(problem, self.needs, (t, self.t_end), &stepper.state()) {
                return Some(t);
            }
        }
        None
    }
}
