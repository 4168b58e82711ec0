//! Steps against twice as many of half their length: whether given steps resolve the motion at all.

use super::{Plan, Problem};
use crate::gauss::velocity;
use crate::run::watch::{LEAST, rounding};
use crate::{Doubt, InputError};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint, VelocityPoint, larger, largest};

/// The difference from two halves, relative to the motion, from which on a step does not resolve it. Of the orders that there are
/// a step then has an error of its own of a twentieth, or a fifteenth with order one.
const APART: f64 = 0.05;

impl<L: Lagrangian<N>, const N: usize> Plan<'_, L, N> {
    /// The misfit of some steps; above one where they do not resolve the motion. `None` where there is nothing to compare with.
    pub(super) fn against_halves(&self, Doubt { steps, t, from, to, .. }: &Doubt<N>) -> Option<f64> {
        let Problem { lagrangian, start, .. } = *self.problem;
        let v = velocity(lagrangian, *t, from, start.v).ok()?;
        let end = t + *steps as f64 * self.h;
        let at_end = |x: &PhasePoint<N>| velocity(lagrangian, end, x, v).ok();
        if self.facts.by_clock {
            return None;
        }
        let fine = match self.reach((*t, from), &v, 0.5 * self.h, 2 * steps) {
            Ok((fine, _)) => fine,
            // What shorter steps do not get over a longer one should not.
            Err(_) => return Some(f64::INFINITY),
        };
        let (coarse_v, fine_v) = (at_end(to)?, at_end(&fine)?);
        let size = |x: [&SVector<f64, N>; 3]| largest(x.into_iter().flat_map(|x| x.iter().copied()));
        let apart = |a: &SVector<f64, N>, b: &SVector<f64, N>| largest((a - b).iter().copied());
        let relative = |apart: f64, size: f64| if apart == 0.0 { 0.0 } else { apart / size };
        let width = larger(size([&from.q, &to.q, &fine.q]), rounding(&start.q, &start.v, self.h));
        let of_v = apart(&coarse_v, &fine_v);
        let of_v =
            if of_v * self.h.abs() > LEAST * width { relative(of_v, size([&v, &coarse_v, &fine_v])) } else { 0.0 };
        Some(larger(relative(apart(&to.q, &fine.q), width), of_v) / APART)
    }

    /// The end of some steps of another length, from a state with its velocity, and `sigma_d` of the last of them; by a clock of one step that
    /// ends after the time h.
    pub(super) fn reach(
        &self,
        (t, from): (f64, &PhasePoint<N>),
        v: &SVector<f64, N>,
        h: f64,
        count: usize,
    ) -> Result<(PhasePoint<N>, f64), InputError> {
        let start = VelocityPoint { q: from.q, v: *v, z: from.z };
        let problem = Problem { t0: t, start, state: *from, ..*self.problem };
        // A step of the clock is cut where it passes the time.
        let length = if self.facts.by_clock { self.h } else { h };
        let mut run = self.make_stepper(&problem, length, false)?;
        run.advance_until(count, t + h).map_err(|halt| InputError::FirstStep(halt.cause))?;
        Ok((run.state(), run.sigma()))
    }
}
