//! Motions that have come to rest.

use crate::run::accuracy::first_guess::first_guess;
use crate::run::checks::rest::{is_at_rest, rests_at_the_origin, starts_at_rest};
use crate::run::request::Request;
use crate::{GaussCollocation, Integrator, StepperOptions};
use contact_geom::{Derivatives, Lagrangian};

/// The decrease of the logarithm of the conformal factor that is at least required before a motion is at rest: the
/// logarithm of the amplitude of oscillations decreases by half of it.
const FALLS: f64 = 1000.0;

/// The number of steps of the search for the time of rest, and between two checks.
const SEARCHED: usize = 1 << 20;
const STRIDE: usize = 64;

impl<L: Lagrangian<N>, const N: usize> Request<'_, L, N> {
    /// The time at which the motion comes to rest, if it lies within the span; found with steps of eight stages, if the
    /// span is long enough for the decay.
    #[inline(never)]
    pub(crate) fn time_of_rest(&self) -> Option<f64> {
        let problem = self.problem;
        let fall = problem.lagrangian.gradient(problem.t0, &problem.start).z * self.span;
        // Written so that a NaN counts as no decrease.
        let falls = fall < -FALLS;
        if !falls || starts_at_rest(problem) || !rests_at_the_origin(problem, problem.start.z) {
            return None;
        }
        let gauss = GaussCollocation { stages: 8 };
        let h = self.span / first_guess(self, gauss.stages, 1e-3) as f64;
        let options = StepperOptions { action: self.needs.action, watched: false };
        let mut stepper = Integrator::stepper(&gauss, problem, h, options).ok()?;
        for _ in 0..SEARCHED / STRIDE {
            stepper.advance(STRIDE).ok()?;
            let t = stepper.time();
            if (t - problem.t0).abs() >= self.span.abs() {
                return None;
            }
            if is_at_rest(problem, self.needs, t, &stepper.state()) {
                return Some(t);
            }
        }
        None
    }
}
