//! Ensembles to a wanted error.

use super::Ensemble;
use crate::ensemble::lane::Lane;
use crate::{GaussCollocation, Run, Steps};
use contact_geom::{Lagrangian, PhasePoint};

/// [`Run::accuracy`].
type Within<L, const N: usize> = for<'p, 'o> fn(Run<'p, 'o, L, N>, f64) -> Run<'p, 'o, L, N>;

/// How long the steps of the members are.
pub(crate) enum StepControl<L, const N: usize> {
    Given(Steps),
    /// For a wanted error: in a program that asks for none trial runs are not compiled.
    For(f64, Within<L, N>),
}

impl<L, const N: usize> Clone for StepControl<L, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L, const N: usize> Copy for StepControl<L, N> {}

impl<L: Lagrangian<N>, const N: usize> StepControl<L, N> {
    /// A run by such steps.
    pub fn of<'p, 'o>(&self, run: Run<'p, 'o, L, N>) -> Run<'p, 'o, L, N> {
        match self {
            StepControl::Given(steps) => run.steps(*steps),
            StepControl::For(wanted, within) => within(run, *wanted),
        }
    }

    pub fn wanted(&self) -> Option<f64> {
        if let StepControl::For(wanted, _) = self { Some(*wanted) } else { None }
    }
}

impl<'a, L: Lagrangian<N> + Sync, const N: usize> Ensemble<'a, L, N> {
    /// The same to an error of (q, p) at the end, relative to its size there; where no integrator is named, by contact Gauss collocation of 8
    /// stages, or 12 below 1e-10.
    ///
    /// In lanes all members take steps of one length: those of the worst of four members by trial runs, an eighth more. Each member is run by
    /// twice as many too, and its error is the distance of the two. One that is beyond what is wanted has a run of its own, by steps of its
    /// own, as have all members where there is no kernel; if it cannot be had, the member is refused with the error that was reached. So what is
    /// promised holds for each member, as far as two runs that agree are right; three times the work of given steps is its price.
    pub fn accuracy(self, wanted: f64) -> Self {
        fn within<'p, 'o, L: Lagrangian<N>, const N: usize>(run: Run<'p, 'o, L, N>, wanted: f64) -> Run<'p, 'o, L, N> {
            run.accuracy(wanted)
        }
        let stages = if wanted < 1e-10 { 12 } else { 8 };
        let of = if self.integrator.is_some() { self } else { self.by(GaussCollocation { stages }) };
        Ensemble { length: Some(StepControl::For(wanted, within)), ..of }
    }
}

/// Refuses, as what is not finite, what is farther from where twice as many steps lead.
pub(crate) fn refuse_beyond<const N: usize>(wanted: f64, lanes: &mut [Lane<N>], finer: &[Lane<N>]) {
    let square = |x: &PhasePoint<N>| x.q.norm_squared() + x.p.norm_squared();
    for (Lane { state: x, .. }, Lane { state: fine, .. }) in lanes.iter_mut().zip(finer) {
        let apart = square(&PhasePoint { q: x.q - fine.q, p: x.p - fine.p, z: 0.0 });
        // What is not a number is not within either.
        let within = apart <= wanted * wanted * square(fine);
        if !within {
            x.z = f64::NAN;
        }
    }
}
