//! Steps in doubt: whether what turned the velocity is narrower than they are.

use crate::Problem;
use crate::resolution::monitor::{ROUNDED, rounding, size};
use crate::run::discretization::Discretization;
use crate::solve::hermite::hermite;
use crate::{UnresolvedStep, integration::SuspectInterval, theory::legendre_inverse};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    Lagrangian,
    numbers::{max_abs_or_nan, max_or_nan},
    support::herglotz_rates,
};

/// The parts of the steps in doubt at whose ends the acceleration is taken.
const PARTS: usize = 32;

/// What a jump of the acceleration gains in a step, in units of the velocity, from which on the step does not resolve it: a tenth, which
/// is what a step may be wrong by that has all of it on the wrong side of the jump.
const JUMP: f64 = 0.1;

impl<L: Lagrangian<N>, const N: usize> Discretization<'_, L, N> {
    /// What becomes of a doubt: a mark, where shorter steps differ or the acceleration jumps.
    pub(crate) fn unresolved_within(&self, doubt: &SuspectInterval<N>) -> Option<UnresolvedStep> {
        let halves = self.against_halves(doubt).unwrap_or(0.0);
        // Long steps of many stages are no cubic curves, and they see what jumps between their nodes; on jumps that L states steps end.
        let jump = if self.many_stages() || self.switches { None } else { self.jump(doubt) };
        let defect = max_or_nan(halves, jump.unwrap_or(0.0));
        // A NaN is a misfit too.
        if defect <= 1.0 { None } else { Some(UnresolvedStep { step: doubt.step + doubt.steps - 1, defect }) }
    }

    /// The misfit of the largest second difference of the acceleration along the cubic curve through both ends: a jump has it however
    /// close the points are, and what is smooth falls with their square. `None` where no velocity is known.
    fn jump(&self, SuspectInterval { step, steps, t, from, to }: &SuspectInterval<N>) -> Option<f64> {
        let Problem { lagrangian, start: first, .. } = *self.problem;
        let span = *steps as f64 * self.h;
        let start = legendre_inverse(lagrangian, *t, from, &first.v).ok()?;
        let end = legendre_inverse(lagrangian, t + span, to, &start.v).ok()?;
        // Substeps back and forth meet what lies beside the steps; but nothing is beside the run.
        let aside = if self.info.substeps { 0.5 * self.h } else { 0.0 };
        // However strong.
        let exact_drag = self.info.exact_rate;
        let before = if *step > 0 { aside } else { 0.0 };
        let after = if step + steps < self.count { aside } else { 0.0 };
        let (mut accelerations, mut speed) = ([SVector::<f64, N>::zeros(); PARTS + 1], 0.0);
        for (i, acceleration) in accelerations.iter_mut().enumerate() {
            let at = (before + span + after) * (i as f64 / PARTS as f64) - before;
            let x = hermite(&start, &end, span, at);
            speed = max_or_nan(speed, size(&x.v));
            // Where the curve leaves the domain of L this is not finite: the steps are none of the motion's.
            let (rates, drag) = herglotz_rates(lagrangian, t + at, &x).ok()?;
            *acceleration = if exact_drag { rates.y - x.v * drag } else { rates.y };
        }
        let jump = max_abs_or_nan(accelerations.windows(3).map(|a| size(&(a[2] - a[1] * 2.0 + a[0]))));
        // Forces are rounded at the size of the motion where it starts, and where it is.
        let floor = max_or_nan(rounding(&first.q, &first.v, self.h), ROUNDED * size(&to.q));
        let rounded = jump * self.h * self.h <= floor;
        Some(if rounded { 0.0 } else { jump * self.h.abs() / (JUMP * speed) })
    }
}
