//! The steps of the members.

use crate::{Run, Steps};
use contact_geom::Lagrangian;

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
