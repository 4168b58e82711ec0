//! Observers of tests.

use discrete_herglotz::{Observer, StepView, Stop};
use std::ops::ControlFlow;

/// Ends a run after this step; the name is the cause.
pub struct StopsAt(pub usize, pub &'static str);

impl<const N: usize> Observer<N> for StopsAt {
    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        if at.k == self.0 { ControlFlow::Break(Stop::here(self.1)) } else { ControlFlow::Continue(()) }
    }
}

/// Passes every step to a function.
pub struct Each<F>(pub F);

impl<const N: usize, F: FnMut(&StepView<'_, N>)> Observer<N> for Each<F> {
    fn step(&mut self, at: &StepView<'_, N>) -> ControlFlow<Stop<N>> {
        (self.0)(at);
        ControlFlow::Continue(())
    }
}
