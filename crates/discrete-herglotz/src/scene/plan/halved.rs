//! Steps against twice as many of half their length: whether given steps resolve the motion at all.

use super::Plan;
use crate::gauss::velocity;
use crate::watch::{LEAST, rounding};
use crate::{Doubt, Flow, Gauss, Halt, Integrator, Stepper};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint, larger, largest};

/// The difference from two halves, relative to the motion, from which on a step does not resolve it. Of the orders that there are
/// a step then has an error of its own of a twentieth, or a fifteenth with order one.
const APART: f64 = 0.05;

impl<L: Lagrangian<N>, const N: usize> Plan<'_, L, N> {
    /// The misfit of some steps; above one where they do not resolve the motion. `None` where there is nothing to compare with.
    pub(super) fn against_halves(&self, Doubt { steps, t, from, to, .. }: &Doubt<N>) -> Option<f64> {
        let v = velocity(self.lagrangian, *t, from, self.guess).ok()?;
        let end = t + *steps as f64 * self.h;
        let at_end = |x: &PhasePoint<N>| velocity(self.lagrangian, end, x, v).ok();
        let fine = match self.halves(*t, from, &v, 2 * steps)? {
            Ok(fine) => fine,
            // What shorter steps do not get over a longer one should not.
            Err(_) => return Some(f64::INFINITY),
        };
        let (coarse_v, fine_v) = (at_end(to)?, at_end(&fine)?);
        let size = |x: [&SVector<f64, N>; 3]| largest(x.into_iter().flat_map(|x| x.iter().copied()));
        let apart = |a: &SVector<f64, N>, b: &SVector<f64, N>| largest((a - b).iter().copied());
        let relative = |apart: f64, size: f64| if apart == 0.0 { 0.0 } else { apart / size };
        let width = larger(size([&from.q, &to.q, &fine.q]), rounding(&self.start.q, &self.guess, self.h));
        let of_v = apart(&coarse_v, &fine_v);
        let of_v = if of_v * self.h > LEAST * width { relative(of_v, size([&v, &coarse_v, &fine_v])) } else { 0.0 };
        Some(larger(relative(apart(&to.q, &fine.q), width), of_v) / APART)
    }

    /// The end of some steps of half the length.
    fn halves(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        v: &SVector<f64, N>,
        count: usize,
    ) -> Option<Result<PhasePoint<N>, Halt>> {
        let h = 0.5 * self.h;
        let end = |run: &mut dyn Stepper<N>| Some(run.advance(count).map(|()| run.state()));
        match self.integrator {
            Integrator::Clocked { .. } => None,
            Integrator::Gauss { stages } => {
                let half = Gauss::new(self.lagrangian, stages, h).ok()?;
                end(&mut half.stepper(t, *from, *v).ok()?)
            }
            Integrator::Discrete(method) => {
                let half = method.discretise(self.lagrangian, h, t, from).ok()?;
                end(&mut Flow::with_guess(&half, t, *from, *v).ok()?)
            }
            _ => end(&mut *self.explicit(h, t, *from, false).ok()?),
        }
    }
}
