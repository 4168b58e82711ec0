//! The error estimate of a run with given steps.

use crate::integration::motion::NearbyVelocity;
use crate::run::accuracy::limits::MAX_UNCHECKED_STEPS;
use crate::run::accuracy::track::Track;
use crate::run::accuracy::velocities::Velocities;
use crate::run::discretization::Discretization;
use crate::{Interrupt, State};

impl Discretization<'_> {
    /// The distance of (q, p) and v from those of a run with twice as many steps of half the size, as in
    /// [`Track::distance_at_end`]: for a method of order p this is the error times `1 - 2^-p`. Infinite if the other
    /// run fails or is interrupted.
    pub(crate) fn distance_from_halves(&self, taken: usize, t: f64, (end, near): (&State, NearbyVelocity<'_>)) -> f64 {
        let Ok(mut fine) = self.stepper_of(&self.problem, 0.5 * self.h, false) else { return f64::INFINITY };
        let steps = if self.info.in_transformed_time { usize::MAX } else { 2 * taken };
        let mut velocities = Velocities::new(&self.problem, self.scales.as_ref());
        let mut done = 0;
        while done < steps && (fine.time() - t) * self.h < 0.0 {
            if self.problem.interrupt.is_some_and(Interrupt::is_requested) {
                return f64::INFINITY;
            }
            // Few steps at first, so that the velocity is sampled at more than one phase of an oscillation.
            match fine.advance_until((steps - done).min(MAX_UNCHECKED_STEPS).min(done.max(1)), t) {
                Ok(more) if more > 0 => done += more,
                Ok(_) => break,
                Err(_) => return f64::INFINITY,
            }
            velocities.at(fine.time(), &fine.state(), fine.last_velocity().as_ref());
        }
        let mut track = |state: &State, near: NearbyVelocity<'_>| {
            let v = velocities.at(t, state, near);
            let (speed, scales) = (velocities.speed(done), self.scales.clone());
            Track { speed, scales, ..Track::of_end(state, v) }
        };
        let coarse = track(end, near);
        let distance = coarse.distance_at_end(&track(&fine.state(), fine.last_velocity().as_ref()));
        if distance.is_nan() { f64::INFINITY } else { distance }
    }
}
