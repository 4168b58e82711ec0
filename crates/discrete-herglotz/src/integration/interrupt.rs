//! Interruption of a computation from outside.

use std::fmt::{Debug, Formatter};

/// The cause of the end of an interrupted run, as reported by its [`Status`](crate::Status).
pub const INTERRUPTION: &str = "an interruption";

/// The number of steps between two queries: some hundred microseconds of short steps.
pub(crate) const STEPS_BETWEEN_QUERIES: usize = 256;

/// A predicate that is queried periodically during a computation and ends it when it becomes true, for example after
/// Ctrl-C.
#[derive(Clone, Copy)]
pub struct Interrupt<'a>(&'a (dyn Fn() -> bool + Sync));

impl<'a> Interrupt<'a> {
    /// An interrupt that ends the computation once this returns true. It is queried every few hundred steps, on the
    /// threads of the runs.
    pub fn when(is_requested: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Interrupt(is_requested)
    }

    pub(crate) fn is_requested(self) -> bool {
        (self.0)()
    }
}

impl Debug for Interrupt<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str("Interrupt")
    }
}
