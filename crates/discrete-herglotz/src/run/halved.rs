//! Steps against twice as many of half their length: whether given steps resolve the motion at all.

use super::{Plan, Problem};
use crate::run::watch::{LEAST, rounding};
use crate::{Doubt, InputError, Stepper, legendre_inverse};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint, VelocityPoint, larger, largest};

/// The difference from two halves, relative to the motion, from which on a step does not resolve it. Of the orders that there are
/// a step then has an error of its own of a twentieth, or a fifteenth with order one.
const APART: f64 = 0.05;

/// The steps from rest in which a method of order one is off by as much as it moves.
const FIRST_STEPS: f64 = 16.0;

impl<'p, L: Lagrangian<N>, const N: usize> Plan<'p, L, N> {
    /// The misfit of some steps; above one where they do not resolve the motion. `None` where there is nothing to compare with.
    pub(super) fn against_halves(&self, Doubt { steps, t, from, to, .. }: &Doubt<N>) -> Option<f64> {
        let Problem { lagrangian, start, .. } = *self.problem;
        let VelocityPoint { v, .. } = legendre_inverse(lagrangian, *t, from, &start.v).ok()?;
        let end = t + *steps as f64 * self.h;
        let at_end = |x: &PhasePoint<N>| legendre_inverse(lagrangian, end, x, &v).map(|x| x.v).ok();
        if self.facts.by_clock {
            return None;
        }
        let mut fine = self.part((*t, from), &v, 0.5 * self.h).ok()?;
        if fine.advance_until(2 * steps, end).is_err() {
            // What shorter steps do not get over a longer one should not.
            return Some(f64::INFINITY);
        }
        let fine = fine.state();
        let (coarse_v, fine_v) = (at_end(to)?, at_end(&fine)?);
        let size = |x: [&SVector<f64, N>; 3]| largest(x.into_iter().flat_map(|x| x.iter().copied()));
        let apart = |a: &SVector<f64, N>, b: &SVector<f64, N>| largest((a - b).iter().copied());
        let relative = |apart: f64, size: f64| if apart == 0.0 { 0.0 } else { apart / size };
        // From rest, steps of order one are off by what they move over their number.
        let moved =
            if self.facts.order == 1 { FIRST_STEPS * size([&coarse_v, &fine_v, &v]) * self.h.abs() } else { 0.0 };
        let width = larger(larger(size([&from.q, &to.q, &fine.q]), moved), rounding(&start.q, &start.v, self.h));
        let of_v = apart(&coarse_v, &fine_v);
        let of_v =
            if of_v * self.h.abs() > LEAST * width { relative(of_v, size([&v, &coarse_v, &fine_v])) } else { 0.0 };
        Some(larger(relative(apart(&to.q, &fine.q), width), of_v) / APART)
    }

    /// A stepper by steps of another length, from a state with its velocity; by a clock, of the same length in its time: they are cut
    /// where they pass the time that they are to reach.
    pub(super) fn part(
        &self,
        (t, from): (f64, &PhasePoint<N>),
        v: &SVector<f64, N>,
        h: f64,
    ) -> Result<Box<dyn Stepper<N> + 'p>, InputError> {
        let start = VelocityPoint { q: from.q, v: *v, z: from.z };
        let problem = Problem { t0: t, start, state: *from, ..*self.problem };
        self.make_stepper(&problem, if self.facts.by_clock { self.h } else { h }, false)
    }
}
