//! Suspect intervals: whether the acceleration varies faster than the steps resolve.

use crate::integration::hermite;
use crate::integration::{SuspectInterval, SystemProblem};
use crate::resolution::monitor::{rounding, size};
use crate::resolution::thresholds::{MAX_ACCELERATION_JUMP, POSITION_ROUND_OFF};
use crate::run::discretization::Discretization;
use crate::{UnresolvedStep, Vector};
use contact_geom::numbers::{max_abs_or_nan, max_or_nan};

/// The number of parts of a suspect interval at whose ends the acceleration is evaluated: second differences of a
/// smooth acceleration are then a thousandth of what they are over the interval, and those of a jump are not.
const ACCELERATION_PARTS: usize = 32;

impl Discretization<'_> {
    /// Decides on a suspect interval: an unresolved step if shorter steps differ or the acceleration jumps, `None`
    /// otherwise.
    pub(crate) fn unresolved_within(&self, suspect: &SuspectInterval) -> Option<UnresolvedStep> {
        let halves = self.half_step_defect(suspect).unwrap_or(0.0);
        // The cubic curve does not approximate long steps of many stages, which detect jumps between their nodes by
        // defect samples. On jumps given by switching functions steps end.
        let jump = if self.many_stages() || self.switches { None } else { self.jump(suspect) };
        let defect = max_or_nan(halves, jump.unwrap_or(0.0));
        // Written so that a NaN counts as a defect.
        if defect <= 1.0 { None } else { Some(UnresolvedStep { step: suspect.step + suspect.steps - 1, defect }) }
    }

    /// The defect computed from the largest second difference of the acceleration along the cubic curve through both
    /// ends: for a jump it does not depend on the distance of the points, for a smooth acceleration it decreases with
    /// the square of the distance. `None` if no velocity is known.
    fn jump(&self, SuspectInterval { step, steps, t, from, to }: &SuspectInterval) -> Option<f64> {
        let SystemProblem { system, start: first, .. } = &self.problem;
        if system.hints().hamiltonian {
            // Where H_pp is singular the acceleration is not a function of position and velocity.
            return None;
        }
        let span = *steps as f64 * self.h;
        let start = system.legendre_inverse(*t, from, &first.v).ok()?;
        let end = system.legendre_inverse(t + span, to, &start.v).ok()?;
        // Substeps back and forth leave the interval by up to half a step, but they do not leave the span of the run.
        let excursion = if self.info.substeps { 0.5 * self.h } else { 0.0 };
        // If the conformal factor is exact, linear drag is resolved whatever its strength, and is left out.
        let exact_drag = self.info.exact_rate;
        let before = if *step > 0 { excursion } else { 0.0 };
        let after = if step + steps < self.count { excursion } else { 0.0 };
        let mut accelerations: [Vector; ACCELERATION_PARTS + 1] = std::array::from_fn(|_| Vector::default());
        let mut speed = 0.0;
        for (i, acceleration) in accelerations.iter_mut().enumerate() {
            let at = (before + span + after) * (i as f64 / ACCELERATION_PARTS as f64) - before;
            let x = hermite(&start, &end, span, at);
            speed = max_or_nan(speed, size(&x.v));
            // Outside the domain of L the acceleration is not finite, and the interval counts as unresolved.
            let (rates, drag) = system.rates(t + at, &x).ok()?;
            *acceleration = if exact_drag { rates.y - x.v * drag } else { rates.y };
        }
        let jump = max_abs_or_nan(accelerations.windows(3).map(|a| size(&(&a[2] - &a[1] * 2.0 + &a[0]))));
        // The round-off of forces is relative to the size of the motion at the start and at the current position.
        let floor = max_or_nan(rounding(&first.q, &first.v, self.h), POSITION_ROUND_OFF * size(&to.q));
        let rounded = jump * self.h * self.h <= floor;
        Some(if rounded { 0.0 } else { jump * self.h.abs() / (MAX_ACCELERATION_JUMP * speed) })
    }
}
