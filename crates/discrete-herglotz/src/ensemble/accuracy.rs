//! Ensembles to a wanted error.

use crate::ensemble::builder::Ensemble;
use crate::ensemble::step_control::StepControl;
use crate::{GaussCollocation, Run};
use contact_geom::Lagrangian;

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
