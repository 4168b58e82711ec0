//! Observers of tests.

use discrete_herglotz::{Observer, StepView, Stop};
use std::ops::ControlFlow;

/// Ends a run after this step; the name is the cause.
pub struct StopsAt(pub usize, pub &'static str);

impl Observer for StopsAt {
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if at.k == self.0 { ControlFlow::Break(Stop::here(self.1)) } else { ControlFlow::Continue(()) }
    }
}

/// Passes every step to a function.
pub struct Each<F>(pub F);

impl<F: FnMut(&StepView<'_>)> Observer for Each<F> {
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        (self.0)(at);
        ControlFlow::Continue(())
    }
}
