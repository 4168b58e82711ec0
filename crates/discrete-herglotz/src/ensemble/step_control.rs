//! The steps of the members.

use crate::{Problem, Run, Steps};

/// The run of a member.
pub(crate) type TypedRun<'p, 'o, L, const N: usize> = Run<'p, 'o, Problem<'p, L, N>>;

/// [`Run::accuracy`], or with `true` `Run::accuracy_of_equal_steps`.
type Within<L, const N: usize> = for<'p, 'o> fn(TypedRun<'p, 'o, L, N>, f64, bool) -> TypedRun<'p, 'o, L, N>;

/// How the steps of the members are determined.
pub(crate) enum StepControl<L, const N: usize> {
    /// These steps.
    Given(Steps),
    /// For a requested error, as a function pointer: trial runs are not compiled into programs that request none.
    Accuracy(f64, Within<L, N>),
}

impl<L, const N: usize> Clone for StepControl<L, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L, const N: usize> Copy for StepControl<L, N> {}

impl<L, const N: usize> StepControl<L, N> {
    /// The requested error, if one is requested.
    pub fn requested_error(&self) -> Option<f64> {
        if let StepControl::Accuracy(wanted, _) = self { Some(*wanted) } else { None }
    }
}
