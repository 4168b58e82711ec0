//! Ensembles with a requested error.

use crate::GaussCollocation;
use crate::ensemble::builder::Ensemble;
use crate::ensemble::members::Lagrangians;
use crate::ensemble::step_control::{StepControl, TypedRun};
use contact_geom::Lagrangian;

/// The number of stages if no integrator is given.
const DEFAULT_STAGES: usize = 8;

/// The number of stages for errors below [`SMALL_ERROR`], for which the higher order takes fewer evaluations.
const STAGES_FOR_SMALL_ERRORS: usize = 12;

/// See [`STAGES_FOR_SMALL_ERRORS`].
const SMALL_ERROR: f64 = 1e-10;

impl<L: Lagrangian<N> + Sync, const N: usize> Ensemble<'_, Lagrangians<'_, L, N>> {
    /// Requests an error of (q, p) at the end, relative to its size there. If no integrator is given, the lanes take
    /// contact Gauss collocation, with 8 stages, or with 12 for errors below 1e-10.
    ///
    /// In lanes all members take the same equal steps: trial runs of four members determine the largest number of steps
    /// among them, which is increased by an eighth. Each member is also run with twice as many steps, and its error is
    /// the distance of the two runs. A member whose error exceeds the request has a run of its own, as have all members
    /// if there is no kernel for them, or if equal steps suit none of the four. The steps of such a run are those of a
    /// single run with this [accuracy](crate::Run::accuracy): of the given integrator, or of the one that is selected for
    /// the member, so that they vary where its motion has short fast phases. [`Tally::own_plans`](crate::ensemble::Tally)
    /// counts these members. If the accuracy cannot be reached, the member is refused with the error that was reached.
    /// So the error bound holds for each member, as far as two runs that agree are right. The cost in lanes is three
    /// times that of given steps.
    pub fn accuracy(self, wanted: f64) -> Self {
        fn within<'p, 'o, L: Lagrangian<N>, const N: usize>(
            run: TypedRun<'p, 'o, L, N>,
            wanted: f64,
            equal: bool,
        ) -> TypedRun<'p, 'o, L, N> {
            if equal { run.accuracy_of_equal_steps(wanted) } else { run.accuracy(wanted) }
        }
        let stages = if wanted < SMALL_ERROR { STAGES_FOR_SMALL_ERRORS } else { DEFAULT_STAGES };
        let selects_integrator = self.members.selects_integrator || self.members.integrator.is_none();
        let of = if selects_integrator { self.by(GaussCollocation { stages }) } else { self };
        let of = of.with_length(StepControl::Accuracy(wanted, within));
        Ensemble { members: Lagrangians { selects_integrator, ..of.members }, ..of }
    }
}
