//! Motions that have come to rest.

use crate::run::accuracy::first_guess::first_guess;
use crate::run::checks::rest::{is_at_rest, rests_at_the_origin, starts_at_rest};
use crate::run::request::Request;
use crate::{GaussCollocation, Integrator, StepperOptions};
use contact_geom::{Derivatives, Lagrangian};

/// The logarithm by which the conformal factor of a motion falls, at the least, before it is at rest: its oscillations fall by half of it.
const FALLS: f64 = 1000.0;

/// The steps of the search for the time of rest, and those between two looks.
const SEARCHED: usize = 1 << 20;
const STRIDE: usize = 64;

impl<L: Lagrangian<N>, const N: usize> Request<'_, L, N> {
    /// The time at which the motion comes to rest, where that is within the span: by steps of eight stages, for a motion that has long
    /// enough.
    #[inline(never)]
    pub(crate) fn time_of_rest(&self) -> Option<f64> {
        let problem = self.problem;
        let fall = problem.lagrangian.gradient(problem.t0, &problem.start).z * self.span;
        // A NaN is not below.
        let falls = fall < -FALLS;
        if !falls || starts_at_rest(problem) || !rests_at_the_origin(problem, problem.start.z) {
            return None;
        }
        let gauss = GaussCollocation { stages: 8 };
        let h = self.span / first_guess(self, gauss.stages, 1e-3) as f64;
        let wants = StepperOptions { action: self.needs.action, watched: false };
        let mut stepper = Integrator::stepper(&gauss, problem, h, wants).ok()?;
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
